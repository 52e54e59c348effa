//! Cells of a line of CSV.

/// The cells of one line after the other. No cell goes on after the end of its line, so that a
/// quote that is not closed is found where it is.
pub(super) struct Cells {
    reader: csv_core::Reader,
    delimiter: u8,
    /// True if blanks separate.
    by_blanks: bool,
    /// Then the line with a tab for each run of them.
    tabbed: String,
    bytes: Vec<u8>,
    ends: Vec<usize>,
}

/// Stands for any number of blanks and tabs between cells.
const BLANKS: u8 = b' ';

impl Cells {
    pub(super) fn new(separator: u8) -> Self {
        let by_blanks = separator == BLANKS;
        let delimiter = if by_blanks { b'\t' } else { separator };
        let mut builder = csv_core::ReaderBuilder::new();
        builder.delimiter(delimiter);
        builder.terminator(csv_core::Terminator::Any(b'\n'));
        Self {
            reader: builder.build(),
            delimiter,
            by_blanks,
            tabbed: String::new(),
            bytes: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// The cells of a line, without the spaces around them and without quotes; `None` if a quote is
    /// not closed, after which there is no next line.
    pub(super) fn split(&mut self, line: &str) -> Option<impl ExactSizeIterator<Item = &str>> {
        self.tabbed.clear();
        for word in line.split_whitespace().filter(|_| self.by_blanks) {
            // The unit behind a name is a part of it.
            let is_unit = word.starts_with(['[', '(']);
            if !self.tabbed.is_empty() {
                self.tabbed.push(if is_unit { ' ' } else { '\t' });
            }
            self.tabbed += word;
        }
        let line = if self.by_blanks { &self.tabbed } else { line };
        // Room for every cell and for one more, without which the parser would stop to ask.
        let separators = line.bytes().filter(|b| *b == self.delimiter).count();
        self.bytes.resize(line.len() + 1, 0);
        self.ends.resize(separators + 2, 0);
        let (reader, bytes, ends) = (&mut self.reader, &mut self.bytes, &mut self.ends);
        let (_, _, written, ended) = reader.read_record(line.as_bytes(), bytes, ends);
        let (result, _, _, last) =
            reader.read_record(b"\n", &mut bytes[written..], &mut ends[ended..]);
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
