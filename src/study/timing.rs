//! Times that can be trusted: jobs are warmed up, then run in turn, round after round, so that whatever else
//! the machine does meets all of them; a time is a median with its quartiles (of a bake the least), and a comparison
//! the median of the rounds' ratios.

use std::time::Instant;

use serde::Serialize;

/// A median and its quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the runs were below.
    pub median: f64,
    /// A quarter of the runs was below.
    pub lower: f64,
    /// A quarter of the runs was above.
    pub upper: f64,
}

impl Spread {
    /// Of some values; `None` without any.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * (sorted.len() - 1) as f64;
            let (low, part) = (place.floor() as usize, place.fract());
            sorted[low] + part * (sorted[(low + 1).min(sorted.len() - 1)] - sorted[low])
        };
        (!sorted.is_empty()).then(|| Self { median: at(0.5), lower: at(0.25), upper: at(0.75) })
    }
}

/// What one of several jobs took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Timed {
    /// Seconds.
    pub seconds: Spread,
    /// The least of them: what else the machine did only ever adds.
    pub least: f64,
    /// Its seconds over the first job's of the same round.
    pub ratio: Spread,
    /// Rounds that were counted; one, of a job that takes long.
    pub rounds: usize,
}

impl Timed {
    /// The quartiles of the seconds; none of a single round.
    #[must_use]
    pub fn quartiles(&self) -> Option<[f64; 2]> {
        (self.rounds > 1).then_some([self.seconds.lower, self.seconds.upper])
    }
}

/// How often jobs are run.
#[derive(Clone, Copy, Debug)]
pub struct Rounds {
    /// A job whose first run, the warm-up, takes longer than this many seconds is not run again: that run counts.
    pub long: f64,
    /// Rounds at least, after the warm-up.
    pub least: usize,
    /// Rounds at most.
    pub most: usize,
    /// Between the two, rounds go on until this number of seconds has passed.
    pub seconds: f64,
}

impl Default for Rounds {
    fn default() -> Self {
        // Five are the fewest whose quartiles are not their extremes.
        Self { long: f64::INFINITY, least: 5, most: 60, seconds: 0.5 }
    }
}

impl Rounds {
    /// The seconds that [`interleaved`] takes for jobs of these seconds, warm-up and all.
    #[must_use]
    pub fn expected(&self, jobs: &[f64]) -> f64 {
        let short: f64 = jobs.iter().filter(|&&job| job <= self.long).sum();
        let wanted = (self.seconds / short.max(1e-9)).ceil().min(self.most as f64) as usize;
        jobs.iter().sum::<f64>() + short * wanted.max(self.least) as f64
    }
}

/// The seconds that `work` takes.
pub fn seconds_of<T>(work: impl FnOnce() -> T) -> f64 {
    let clock = Instant::now();
    std::hint::black_box(work());
    clock.elapsed().as_secs_f64()
}

/// A piece of work that says how many seconds it took.
pub type Job<'a, E> = &'a mut dyn FnMut() -> Result<f64, E>;

/// Run each job once to warm up, then once a round, in turn, and say what each took, in their order.
///
/// # Errors
/// The first job's that fails.
pub fn interleaved<E>(rounds: Rounds, jobs: &mut [Job<'_, E>]) -> Result<Vec<Timed>, E> {
    let mut times: Vec<Vec<f64>> = Vec::new();
    for job in jobs.iter_mut() {
        // A job may do more than what it counts.
        let clock = Instant::now();
        let seconds = job()?;
        times.push(if clock.elapsed().as_secs_f64() > rounds.long { vec![seconds] } else { Vec::new() });
    }
    let short: Vec<usize> = (0..jobs.len()).filter(|&job| times[job].is_empty()).collect();
    let clock = Instant::now();
    for round in 0..rounds.most.max(1) {
        if round >= rounds.least && clock.elapsed().as_secs_f64() >= rounds.seconds {
            break;
        }
        // Each round begins with another job: none is always the one after a pause.
        for i in 0..short.len() {
            let job = short[(i + round) % short.len()];
            times[job].push(jobs[job]()?);
        }
    }
    Ok(times.iter().filter_map(|own| timed(own, &times[0])).collect())
}

/// What a job took in its rounds, beside what the first job took in them.
fn timed(own: &[f64], first: &[f64]) -> Option<Timed> {
    // What was run once stands beside every round of the other.
    let rounds = own.len().max(first.len());
    let pairs = (0..rounds).filter_map(|round| {
        let at = |times: &[f64]| times.get(round).or(times.last()).copied();
        Some(at(own)? / at(first)?.max(1e-12))
    });
    let ratio = Spread::of(&pairs.collect::<Vec<f64>>())?;
    let least = own.iter().copied().fold(f64::INFINITY, f64::min);
    Some(Timed { seconds: Spread::of(own)?, least, ratio, rounds: own.len() })
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn medians_and_quartiles_are_those_of_the_values() {
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(
            Spread::of(&[4.0, 1.0, 3.0, 2.0, 5.0]),
            Some(Spread { median: 3.0, lower: 2.0, upper: 4.0 })
        );
        assert_eq!(Spread::of(&[2.0, 1.0]), Some(Spread { median: 1.5, lower: 1.25, upper: 1.75 }));
    }

    #[test]
    fn rounds_are_foretold_as_they_are_run() {
        let rounds = Rounds { long: 3.0, least: 3, most: 7, seconds: 1.0 };
        // Once to warm up and three times; a long one once.
        assert_eq!(rounds.expected(&[1.0, 0.5, 4.0]), 5.5 + 3.0 * 1.5);
        // Until a second is over, and seven times at most.
        assert!((rounds.expected(&[0.2]) - (0.2 + 5.0 * 0.2)).abs() < 1e-12);
        assert!((rounds.expected(&[0.01]) - 8.0 * 0.01).abs() < 1e-12);
    }

    #[test]
    fn jobs_are_warmed_up_and_take_turns() {
        let order = std::cell::RefCell::new(Vec::new());
        let mut job = |name: char, seconds: f64| {
            order.borrow_mut().push(name);
            Ok::<f64, Infallible>(seconds)
        };
        let job = std::cell::RefCell::new(&mut job);
        let rounds = Rounds { least: 2, most: 2, seconds: 0.0, ..Rounds::default() };
        let timed = interleaved::<Infallible>(
            rounds,
            &mut [&mut || (job.borrow_mut())('a', 2.0), &mut || (job.borrow_mut())('b', 1.0)],
        );
        let timed = timed.unwrap();
        assert_eq!(*order.borrow(), ['a', 'b', 'a', 'b', 'b', 'a']);
        assert_eq!((timed[0].ratio.median, timed[1].ratio.median, timed[1].rounds), (1.0, 0.5, 2));
    }

    #[test]
    fn a_long_job_is_run_once_and_says_so() {
        let mut runs = [0, 0];
        let [long, short] = &mut runs;
        let mut slow = || {
            *long += 1;
            std::thread::sleep(std::time::Duration::from_millis(20));
            Ok::<f64, Infallible>(4.0)
        };
        let mut quick = || {
            *short += 1;
            Ok(f64::from(*short))
        };
        let rounds = Rounds { long: 0.01, least: 3, most: 3, seconds: 0.0 };
        let timed = interleaved(rounds, &mut [&mut slow, &mut quick]).unwrap();
        assert_eq!((timed[0].rounds, timed[0].quartiles(), timed[0].least), (1, None, 4.0));
        // The first run of the other, one second, is its warm-up.
        assert_eq!((timed[1].rounds, timed[1].least, timed[1].seconds.median), (3, 2.0, 3.0));
        assert_eq!((timed[1].quartiles(), timed[1].ratio.median), (Some([2.5, 3.5]), 0.75));
        assert_eq!(runs, [1, 4]);
    }
}
