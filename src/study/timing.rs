//! Times that can be trusted: jobs are warmed up, then run in turn, round after round, so that whatever else
//! the machine does meets all of them; a time is a median with its quartiles, and a comparison the median of
//! the rounds' ratios.

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
    /// Its seconds over the first job's of the same round.
    pub ratio: Spread,
    /// Rounds that were counted.
    pub rounds: usize,
}

/// How often jobs are run.
#[derive(Clone, Copy, Debug)]
pub struct Rounds {
    /// Rounds that are not counted.
    pub warm_up: usize,
    /// Rounds at least.
    pub least: usize,
    /// Rounds at most.
    pub most: usize,
    /// Between the two, rounds go on until so many seconds have passed.
    pub seconds: f64,
}

impl Default for Rounds {
    fn default() -> Self {
        // Five are the fewest whose quartiles are not their extremes.
        Self { warm_up: 1, least: 5, most: 60, seconds: 0.5 }
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

/// Run each job once a round, in turn, and say what each took, in their order.
///
/// # Errors
/// The first job's that fails.
pub fn interleaved<E>(rounds: Rounds, jobs: &mut [Job<'_, E>]) -> Result<Vec<Timed>, E> {
    for _ in 0..rounds.warm_up {
        for job in jobs.iter_mut() {
            job()?;
        }
    }
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); jobs.len()];
    let clock = Instant::now();
    for round in 0..rounds.most.max(1) {
        if round >= rounds.least && clock.elapsed().as_secs_f64() >= rounds.seconds {
            break;
        }
        // Each round begins with another job: none is always the one after a pause.
        for i in 0..jobs.len() {
            let job = (i + round) % jobs.len();
            times[job].push(jobs[job]()?);
        }
    }
    let timed = |own: &Vec<f64>| {
        let ratios: Vec<f64> = own.iter().zip(&times[0]).map(|(own, first)| own / first.max(1e-12)).collect();
        Some(Timed { seconds: Spread::of(own)?, ratio: Spread::of(&ratios)?, rounds: own.len() })
    };
    Ok(times.iter().filter_map(timed).collect())
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
    fn jobs_are_warmed_up_and_take_turns() {
        let order = std::cell::RefCell::new(Vec::new());
        let mut job = |name: char, seconds: f64| {
            order.borrow_mut().push(name);
            Ok::<f64, Infallible>(seconds)
        };
        let job = std::cell::RefCell::new(&mut job);
        let rounds = Rounds { warm_up: 1, least: 2, most: 2, seconds: 0.0 };
        let timed = interleaved::<Infallible>(
            rounds,
            &mut [&mut || (job.borrow_mut())('a', 2.0), &mut || (job.borrow_mut())('b', 1.0)],
        );
        let timed = timed.unwrap();
        assert_eq!(*order.borrow(), ['a', 'b', 'a', 'b', 'b', 'a']);
        assert_eq!((timed[0].ratio.median, timed[1].ratio.median, timed[1].rounds), (1.0, 0.5, 2));
    }
}
