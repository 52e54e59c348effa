//! Cells of a line of CSV.

/// The cells of one line after the other. No cell goes on after the end of its line, so that a
/// quote that is not closed is found where it is.
pub(super) struct Cells {
    pub(super) separator: u8,
    reader: csv_core::Reader,
    bytes: Vec<u8>,
    ends: Vec<usize>,
}

impl Cells {
    pub(super) fn new(separator: u8) -> Self {
        let mut builder = csv_core::ReaderBuilder::new();
        builder.delimiter(separator);
        builder.terminator(csv_core::Terminator::Any(b'\n'));
        Self {
            separator,
            reader: builder.build(),
            bytes: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// The cells of a line, without the spaces around them and without quotes; `None` if a quote is
    /// not closed, after which there is no next line.
    pub(super) fn split(&mut self, line: &str) -> Option<impl ExactSizeIterator<Item = &str>> {
        // Room for every cell and for one more, without which the parser would stop to ask.
        let separators = line.bytes().filter(|b| *b == self.separator).count();
        self.bytes.resize(line.len() + 1, 0);
        self.ends.resize(separators + 2, 0);
        let line = line.as_bytes();
        let (_, _, written, ended) = self
            .reader
            .read_record(line, &mut self.bytes, &mut self.ends);
        let (result, _, _, last) =
            self.reader
                .read_record(b"\n", &mut self.bytes[written..], &mut self.ends[ended..]);
        if !matches!(result, csv_core::ReadRecordResult::Record) {
            return None;
        }
        let mut start = 0;
        let (bytes, ends) = (&self.bytes, &self.ends[..ended + last]);
        Some(ends.iter().map(move |&end| {
            let cell = &bytes[std::mem::replace(&mut start, end)..end];
            // Text that was cut at ASCII characters is text.
            std::str::from_utf8(cell).unwrap_or_default().trim()
        }))
    }
}
