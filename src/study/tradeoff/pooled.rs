//! The sweeps of several scenes along an axis, as one.

use super::axis::{Setting, Sweep, mark_pareto};
use crate::StudyError;
use crate::prepare::PrepareError;
use crate::reference::Difference;
use crate::timing::{Spread, Timed};

/// One sweep of the sweeps of these scenes, which have the same settings. Errors are those of all views of all scenes; seconds
/// are added up, and all other costs, which are those of a fragment, a lookup or a number, are means; so are counts.
///
/// # Errors
/// When the scenes' settings differ.
pub(super) fn pooled(scenes: &[(&str, Sweep)]) -> Result<Sweep, StudyError> {
    let Some(((_, first), others)) = scenes.split_first() else { return Err(PrepareError::NoScene.into()) };
    if others.is_empty() {
        return Ok(first.clone());
    }
    let names: Vec<&str> = scenes.iter().map(|(name, _)| *name).collect();
    let mut settings = Vec::new();
    for (i, setting) in first.settings.iter().enumerate() {
        let mut all = vec![setting];
        for (_, other) in others {
            let same = other.settings.get(i).filter(|same| same.name == setting.name);
            all.push(same.filter(|_| other.settings.len() == first.settings.len()).ok_or(
                StudyError::Apart { axis: first.axis, why: "the scenes have different settings along it" },
            )?);
        }
        settings.push(together(&all, first.cost == "seconds"));
    }
    mark_pareto(&mut settings);
    let method = format!(
        "{} Scenes: {}. Each is measured by itself. Errors are those of all of their views together, seconds are \
         added up, and other costs and counts are means.",
        first.method,
        names.join(", ")
    );
    Ok(Sweep { method, settings, ..first.clone() })
}

/// One setting in several scenes.
fn together(scenes: &[&Setting], adds: bool) -> Setting {
    let mean = |of: &dyn Fn(&Setting) -> f64| {
        scenes.iter().map(|setting| of(setting)).sum::<f64>() / scenes.len() as f64
    };
    let first = scenes[0];
    let count = |(i, &(name, _)): (usize, &(&'static str, f64))| {
        (name, mean(&|setting| setting.counts.get(i).map_or(0.0, |count| count.1)))
    };
    let times: Option<Vec<Timed>> = scenes.iter().map(|setting| setting.time).collect();
    Setting {
        name: first.name.clone(),
        choose: first.choose,
        error: Difference::pooled(scenes.iter().map(|setting| setting.error)),
        cost: mean(&|setting| setting.cost) * if adds { scenes.len() as f64 } else { 1.0 },
        time: times.map(|times| added(&times)),
        counts: first.counts.iter().enumerate().map(count).collect(),
        reference: first.reference,
        present: scenes.iter().any(|setting| setting.present),
        pareto: false,
    }
}

/// The time of one job after the other: medians and quartiles added up, and the mean of their ratios.
fn added(times: &[Timed]) -> Timed {
    let sum = |of: &dyn Fn(&Timed) -> f64| times.iter().map(of).sum::<f64>();
    let spread = |of: &dyn Fn(&Timed) -> Spread, share: f64| Spread {
        median: share * sum(&|time| of(time).median),
        lower: share * sum(&|time| of(time).lower),
        upper: share * sum(&|time| of(time).upper),
    };
    Timed {
        seconds: spread(&|time| time.seconds, 1.0),
        least: sum(&|time| time.least),
        ratio: spread(&|time| time.ratio, 1.0 / times.len().max(1) as f64),
        rounds: times.iter().map(|time| time.rounds).min().unwrap_or(0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(costs: [f64; 2], name: &str) -> Sweep {
        let setting = |cost: f64, name: &str, reference: bool| Setting {
            name: name.to_owned(),
            choose: None,
            error: Difference::default(),
            cost,
            time: None,
            counts: vec![("KiB", 10.0 * cost)],
            reference,
            present: cost > 2.0,
            pareto: false,
        };
        Sweep {
            axis: "rays",
            title: "",
            method: "How.".to_owned(),
            cost: "seconds",
            settings: vec![setting(costs[0], name, false), setting(costs[1], "most", true)],
            traces: Vec::new(),
        }
    }

    #[test]
    fn seconds_are_added_up_and_counts_are_means() {
        let one = sweep([1.0, 2.0], "few");
        let same = pooled(&[("noon", one.clone())]).unwrap();
        assert_eq!((same.method.as_str(), same.settings[1].cost), ("How.", 2.0));
        let both = pooled(&[("noon", one.clone()), ("night", sweep([3.0, 4.0], "few"))]).unwrap();
        let of = |setting: &Setting| (setting.cost, setting.counts[0].1, setting.present, setting.reference);
        let found: Vec<_> = both.settings.iter().map(of).collect();
        assert_eq!(found, [(4.0, 20.0, true, false), (6.0, 30.0, true, true)]);
        assert!(both.method.contains("Scenes: noon, night."));
        let apart = pooled(&[("noon", one), ("night", sweep([1.0, 2.0], "other"))]).unwrap_err();
        assert!(apart.to_string().contains("the axis rays: the scenes have different settings"), "{apart}");
    }

    #[test]
    fn times_are_those_of_one_job_after_the_other() {
        let spread = |median| Spread { median, lower: median - 0.5, upper: median + 0.5 };
        let time = |seconds, rounds| Timed {
            seconds: spread(seconds),
            least: seconds - 1.0,
            ratio: spread(seconds),
            rounds,
        };
        let both = added(&[time(2.0, 7), time(4.0, 3)]);
        let (seconds, ratio) = (both.seconds, both.ratio);
        assert_eq!((seconds.median, seconds.lower, seconds.upper, both.least), (6.0, 5.0, 7.0, 4.0));
        assert_eq!((ratio.median, both.rounds), (3.0, 3));
    }
}
