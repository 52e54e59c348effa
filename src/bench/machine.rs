//! The machine that runs the benches, and the memory that they take there.

use serde::Serialize;
use std::fs;

/// What times depend on.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Name of the processor, or of its architecture where the system does not say.
    pub cpu: String,
    /// Threads that work.
    pub threads: usize,
}

impl Machine {
    /// The one that runs this.
    pub(crate) fn this() -> Self {
        let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = info.lines().find(|l| l.starts_with("model name"));
        let name = model.and_then(|l| l.split(':').nth(1));
        let cpu = name.map_or(std::env::consts::ARCH, str::trim);
        Self {
            cpu: cpu.into(),
            threads: rayon::current_num_threads(),
        }
    }
}

impl std::fmt::Display for Machine {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let threads = crate::error::count(self.threads, "thread");
        write!(f, "{}, {threads}", self.cpu)
    }
}

/// Bytes of this process.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    /// Now.
    pub held: f64,
    /// At most since [`Memory::watched`].
    pub peak: f64,
}

impl Memory {
    /// What is held now, and from where on the peak counts; `None` where the system does not say.
    pub(crate) fn watched() -> Option<Self> {
        // Resets the peak (proc(5)); where that is not allowed, the peak is at least no less than it was.
        fs::write("/proc/self/clear_refs", "5").ok()?;
        Self::now()
    }

    /// What is held, and was at most.
    pub(crate) fn now() -> Option<Self> {
        let status = fs::read_to_string("/proc/self/status").ok()?;
        let kib = |key: &str| {
            let line = status.lines().find(|l| l.starts_with(key))?;
            line.split_whitespace().nth(1)?.parse::<f64>().ok()
        };
        Some(Self {
            held: 1024.0 * kib("VmRSS:")?,
            peak: 1024.0 * kib("VmHWM:")?,
        })
    }
}
