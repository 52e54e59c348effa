//! Ladders: a choice, and what is timed and judged on each of its rungs.

use crate::statistics::median;
use crate::validation::Estimate;
use std::cell::Cell;
use std::time::Instant;

/// How often a rung is timed.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Seconds that are enough for the passes of a rung.
    pub enough: f64,
    /// Seconds of a pass that is long: it is made once, and as it comes. A shorter one is made at least three times,
    /// and once before that for nothing: to warm up.
    pub long: f64,
}

/// Passes of a rung, at most.
const MOST: f64 = 15.0;

impl Effort {
    /// What is known well.
    pub(crate) const USUAL: Self = Self {
        enough: 0.05,
        long: 0.2,
    };
    /// What is known soon.
    pub(crate) const QUICK: Self = Self {
        enough: 0.002,
        long: 0.04,
    };

    /// Timed passes of a rung whose pass takes so long.
    fn repeats(self, seconds: f64) -> usize {
        let fewest = if seconds < self.long { 3.0 } else { 1.0 };
        (self.enough / seconds).ceil().clamp(fewest, MOST) as usize
    }

    /// Passes of it with the one for nothing.
    pub(super) fn passes(self, seconds: f64) -> usize {
        self.repeats(seconds) + usize::from(seconds < self.long)
    }
}

/// Times of the passes of a rung, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// The one in the middle.
    pub median: f64,
    /// The shortest.
    pub min: f64,
    /// The longest.
    pub max: f64,
    /// Number of passes.
    pub repeats: usize,
}

impl Times {
    fn of(passes: &[f64]) -> Self {
        Self {
            median: median(passes).unwrap_or_default(),
            min: passes.iter().copied().fold(f64::INFINITY, f64::min),
            max: passes.iter().copied().fold(0.0, f64::max),
            repeats: passes.len(),
        }
    }
}

/// The clock of a pass.
#[derive(Debug, Default)]
pub struct Watch(Cell<f64>);

impl Watch {
    /// Does what is not to be timed.
    pub(crate) fn aside<T>(&self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let made = work();
        self.0.set(self.0.get() + start.elapsed().as_secs_f64());
        made
    }
}

/// How good what a pass made is.
#[derive(Clone, Debug)]
pub struct Judged {
    /// A value for each column of the section; its error is a standard error, or the bound to which it is known.
    pub values: Vec<Estimate>,
    /// True if a further rung would make the same.
    pub is_last: bool,
    /// True if errors may be extrapolated beyond this rung.
    pub is_lawful: bool,
}

impl Judged {
    /// Of a rung like others.
    pub(crate) fn new(values: Vec<Estimate>) -> Self {
        Self {
            values,
            is_last: false,
            is_lawful: true,
        }
    }
}

/// What came of a rung.
pub(super) struct Ran {
    pub times: Times,
    pub judged: Judged,
    /// Wall time of a pass and of judging, s.
    pub pass: f64,
    pub judging: f64,
}

type Run = dyn Fn(Effort, &dyn Fn() -> bool) -> Result<Ran, String>;

/// What is timed and judged.
pub struct Rung {
    /// Its name.
    pub setting: String,
    /// Seconds of a pass, up to a factor that the rungs of a ladder share.
    pub work: f64,
    run: Box<Run>,
}

impl Rung {
    /// A rung whose passes make something, which is judged once; either may say why it cannot.
    pub(crate) fn new<T>(
        setting: impl Into<String>,
        work: f64,
        pass: impl Fn(&Watch) -> Result<T, String> + 'static,
        judge: impl Fn(T) -> Result<Judged, String> + 'static,
    ) -> Self {
        let run = move |effort: Effort, go_on: &dyn Fn() -> bool| {
            let mut passes = Vec::new();
            let mut is_warm = false;
            loop {
                let (watch, start) = (Watch::default(), Instant::now());
                let made = pass(&watch)?;
                let all = start.elapsed().as_secs_f64();
                let seconds = (all - watch.0.get()).max(f64::MIN_POSITIVE);
                if !is_warm && seconds < effort.long && go_on() {
                    is_warm = true;
                    continue;
                }
                passes.push(seconds);
                if passes.len() >= effort.repeats(passes[0]) || !go_on() {
                    let start = Instant::now();
                    return Ok(Ran {
                        judged: judge(made)?,
                        times: Times::of(&passes),
                        pass: all,
                        judging: start.elapsed().as_secs_f64(),
                    });
                }
            }
        };
        Self {
            setting: setting.into(),
            work,
            run: Box::new(run),
        }
    }

    /// Times and judges it; `go_on` is asked before each pass.
    pub(super) fn run(&self, effort: Effort, go_on: &dyn Fn() -> bool) -> Result<Ran, String> {
        (self.run)(effort, go_on)
    }
}

/// A choice, from its cheapest rung on.
pub struct Ladder {
    /// Its names, but for the rung's.
    pub names: Vec<String>,
    /// Its rungs.
    pub rungs: Vec<Rung>,
    /// Expected seconds of a pass and of judging it, rung by rung; `None`: those of the first rung, in proportion to
    /// the work.
    pub pilot: Option<Box<Pilot>>,
}

/// Seconds of a pass and of judging it.
type Expected = [f64; 2];

/// What is expected of each rung.
type Pilot = dyn Fn() -> Result<Vec<Expected>, String>;

impl Ladder {
    /// A choice whose rungs take in proportion to their work.
    pub(crate) fn new(
        names: impl IntoIterator<Item = impl Into<String>>,
        rungs: impl IntoIterator<Item = Rung>,
    ) -> Self {
        Self {
            names: names.into_iter().map(Into::into).collect(),
            rungs: rungs.into_iter().collect(),
            pilot: None,
        }
    }

    /// Seconds of each rung. What is run for that warms up.
    pub(super) fn seconds(&self, effort: Effort) -> Result<Vec<f64>, String> {
        let expected = match &self.pilot {
            Some(pilot) => pilot()?,
            None => self.in_proportion()?,
        };
        let of = |[pass, judging]: Expected| pass * effort.passes(pass) as f64 + judging;
        Ok(expected.into_iter().map(of).collect())
    }

    fn in_proportion(&self) -> Result<Vec<Expected>, String> {
        let Some(first) = self.rungs.first() else {
            return Ok(Vec::new());
        };
        let [enough, long] = [0.0; 2];
        let ran = first.run(Effort { enough, long }, &|| true)?;
        let of = |rung: &Rung| [ran.pass * rung.work / first.work, ran.judging];
        Ok(self.rungs.iter().map(of).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts its passes.
    fn counted(passes: &std::rc::Rc<Cell<usize>>) -> Rung {
        let passes = std::rc::Rc::clone(passes);
        let pass = move |watch: &Watch| {
            watch.aside(|| std::thread::sleep(std::time::Duration::from_millis(5)));
            passes.set(passes.get() + 1);
            Ok(passes.get())
        };
        let judge = |n: usize| Ok(Judged::new(vec![Estimate::new(n as f64, None)]));
        Rung::new("", 1.0, pass, judge)
    }

    #[test]
    fn short_passes_are_warmed_up_and_repeated() {
        let passes = std::rc::Rc::default();
        let ran = counted(&passes).run(Effort::QUICK, &|| true).unwrap();
        assert!((3..=MOST as usize).contains(&ran.times.repeats));
        assert_eq!(passes.get(), 1 + ran.times.repeats);
        // What is put aside is not in the time of a pass, and is in that of the whole.
        assert!(ran.times.median < 1e-3 && ran.pass > 4e-3);
        assert!(ran.times.min <= ran.times.median && ran.times.median <= ran.times.max);
        // The last one is judged.
        assert_eq!(ran.judged.values[0].value, Some(passes.get() as f64));
    }

    #[test]
    fn who_is_stopped_makes_one_pass() {
        let passes = std::rc::Rc::default();
        let ran = counted(&passes).run(Effort::USUAL, &|| false).unwrap();
        assert_eq!((passes.get(), ran.times.repeats), (1, 1));
    }
}
