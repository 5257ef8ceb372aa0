//! All that make images of cases.

use fearless_simd::Level;
use skinfit::gpu::Gpu;
use skinfit::model::params::Param;
use skinfit::simd::levels;
#[cfg(feature = "burn")]
use skinfit::tensor::SharedDevice;

use super::cases::{Cases, Shown};
use super::{engines, rules, table};
use crate::by_rules::Kind;
use crate::vectors::reader::{Node, Tolerance};

/// One of them.
pub(super) enum On {
    Rules(Kind),
    /// The engine there with the instructions of a level.
    Processor(Level),
    /// The engine there.
    Adapter(&'static Gpu),
    #[cfg(feature = "burn")]
    Tensors(&'static SharedDevice),
}

impl On {
    /// Those that this machine has.
    pub(super) fn all() -> Vec<Self> {
        let mut all: Vec<Self> = Kind::all().into_iter().map(Self::Rules).collect();
        all.extend(levels().into_iter().map(Self::Processor));
        all.extend(crate::graphics::bench::gpu().map(Self::Adapter));
        #[cfg(feature = "burn")]
        all.extend(crate::tensors::bench::shared().map(Self::Tensors));
        all
    }

    fn name(&self) -> String {
        match self {
            Self::Rules(kind) => format!("rules in {kind:?}"),
            Self::Processor(level) => format!("cpu at {level:?}"),
            Self::Adapter(_) => "gpu".to_owned(),
            #[cfg(feature = "burn")]
            Self::Tensors(_) => "burn".to_owned(),
        }
    }

    /// What is near: what the file gives f64, or four times what it gives f32. Samples hold rounded directions, of which normals
    /// are made unit once more; and lanes and WGSL have exp2, log2, quotients and roots to a few units in the last place.
    fn near(&self, file: &Node<'_>, f32_rel: Option<f64>) -> Tolerance {
        let near = file.vector.tolerances();
        match self {
            Self::Rules(Kind::Double) => near.double,
            _ => Tolerance { rel: f32_rel.unwrap_or(near.single.rel), ..near.single }.times(4.0),
        }
    }

    fn shown(&self, cases: &Cases) -> Vec<Option<Shown>> {
        let all = |shown: Vec<Shown>| shown.into_iter().map(Some).collect();
        match self {
            Self::Rules(kind) => all(rules::shown(*kind, cases)),
            Self::Processor(level) => all(engines::on_processor(*level, cases)),
            Self::Adapter(gpu) => all(engines::on_adapter(gpu, cases)),
            #[cfg(feature = "burn")]
            Self::Tensors(shared) => super::tensors::shown(shared, cases),
        }
    }

    pub(super) const fn is_exact(&self) -> bool {
        matches!(self, Self::Rules(Kind::Double))
    }
}

/// A case on an evaluator.
pub(super) struct Told<'a> {
    pub(super) on: &'a On,
    columns: &'a [Param],
    shown: &'a Shown,
    /// Its number in the file.
    pub(super) at: usize,
    pub(super) near: Tolerance,
}

impl Told<'_> {
    pub(super) const fn rgb(&self) -> [f64; 3] {
        self.shown.rgb
    }

    /// How it moves with a parameter; `None` where that cannot be free.
    pub(super) fn slope(&self, param: Param) -> Option<[f64; 3]> {
        self.shown.slopes[self.columns.iter().position(|column| *column == param).unwrap()]
    }

    #[track_caller]
    pub(super) fn check(&self, what: &str, got: [f64; 3], want: &Node<'_>) {
        self.near.check(&format!("{what} on {}", self.on.name()), &got, want);
    }

    /// [`Self::check`] of a slope, where there is one.
    #[track_caller]
    pub(super) fn check_slope(&self, param: Param, want: &Node<'_>) {
        if let Some(slope) = self.slope(param) {
            self.check(param.name(), slope, want);
        }
    }
}

/// Each case on each evaluator of the file's row.
pub(super) fn compare(file: &Node<'_>, cases: &Cases, check: impl Fn(&Told<'_>)) {
    compare_on(table::evaluators(&file.vector.name), file, cases, check);
}

/// Each case on each engine of the file's row, and on tensors.
pub(super) fn compare_on_engines(file: &Node<'_>, cases: &Cases, check: impl Fn(&Told<'_>)) {
    let mut evaluators = table::evaluators(&file.vector.name);
    evaluators.retain(|on| !matches!(on, On::Rules(_)));
    compare_on(evaluators, file, cases, check);
}

fn compare_on(evaluators: Vec<On>, file: &Node<'_>, cases: &Cases, check: impl Fn(&Told<'_>)) {
    for on in evaluators {
        let all = on.shown(cases);
        // Tensors hold what is no column, at the value of most cases.
        let count = all.iter().flatten().count();
        assert!(6 * count >= cases.each.len(), "{count} cases on {}", on.name());
        let told = cases.each.iter().zip(&all).filter_map(|(case, shown)| {
            let near = on.near(file, case.f32_rel);
            Some(Told { on: &on, columns: &cases.columns, shown: shown.as_ref()?, at: case.at, near })
        });
        told.for_each(|told| check(&told));
    }
}
