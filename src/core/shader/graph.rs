//! The graph of quantities under one set of facts: what may be wanted in which domain, and the means that give it.

use std::collections::{BTreeMap, BTreeSet};

use super::bits::Bits;
use super::domain::{Domain, EDGES, Edge, EdgeError};
use super::emit::{Fields, texel_fields};
use super::facts::{Budget, Facts};
use super::quantity::{Attribute, Constant};
use super::rule::{Rule, rules};
use super::search::{PlanError, components};
use crate::model::effects::Effects;

/// A wanted quantity, and the domain where it is wanted.
pub(super) type Want = (Domain, &'static str);

/// A quantity on an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// The edge.
    pub edge: &'static Edge,
    /// The quantity.
    pub quantity: &'static str,
    /// How many numbers it holds.
    pub numbers: usize,
    /// How far it is off where it arrives, relative to white.
    pub error: f64,
}

impl Carried {
    /// Operations a fragment.
    #[must_use]
    pub fn cost(&self, facts: &Facts) -> f64 {
        let Edge { cost, cost_a_number, .. } = self.edge;
        facts.work.share(self.edge.to) * (cost + cost_a_number * self.numbers as f64)
    }
}

/// What gives a quantity.
#[derive(Clone, Copy, Debug)]
pub(super) enum Means {
    Rule(&'static Rule),
    Edge(Carried),
}

impl Means {
    /// What it needs, what is there without any means left in.
    fn needs(&self) -> Vec<Want> {
        match self {
            Self::Rule(rule) => rule.needs.iter().map(|(q, _)| (rule.domain, *q)).collect(),
            Self::Edge(Carried { edge, quantity, .. }) => {
                let beside = edge.beside.iter().map(|beside| (edge.to, *beside));
                std::iter::once((edge.from, *quantity)).chain(beside).collect()
            }
        }
    }
}

/// The graph.
pub(super) struct Graph<'a> {
    pub(super) facts: &'a Facts,
    /// The wants, by rank: what lies further from the inputs has the greater number.
    wants: Vec<Want>,
    /// For each want, the means that give it.
    means: Vec<Vec<Means>>,
    given: Given<'a>,
}

/// What is there without any means.
struct Given<'a> {
    /// Whose attributes vertices have.
    effects: Effects,
    /// Of fragments.
    fragments: &'a [&'static str],
    /// Of texels.
    texels: Fields,
}

impl<'a> Graph<'a> {
    pub(super) fn new(facts: &'a Facts, fragments: &'a [&'static str]) -> Result<Self, PlanError> {
        let given = Given { effects: facts.setup.effects, fragments, texels: texel_fields(facts) };
        let mut means = all_means(facts);
        let ranks = ranks(&means, &given)?;
        let mut wants: Vec<Want> = means.keys().copied().collect();
        wants.retain(|want| ranks.contains_key(want));
        wants.sort_by_key(|want| (ranks[want], *want));
        if wants.len() > Bits::MOST {
            return Err(PlanError::TooMany { quantities: wants.len(), most: Bits::MOST });
        }
        let means = wants.iter().map(|want| means.remove(want).unwrap_or_default()).collect();
        Ok(Self { facts, wants, means, given })
    }

    pub(super) fn bit(&self, want: Want) -> Option<Bits> {
        self.wants.iter().position(|&w| w == want).map(Bits::one)
    }

    /// The means that give a want.
    pub(super) fn means(&self, at: usize) -> &[Means] {
        &self.means[at]
    }

    /// The wants of a means; `None` when one of them cannot be met.
    pub(super) fn needs(&self, means: &Means) -> Option<Bits> {
        means
            .needs()
            .into_iter()
            .filter(|&want| !self.given.has(want))
            .try_fold(Bits::default(), |bits, want| Some(bits.or(self.bit(want)?)))
    }

    /// Operations a fragment.
    pub(super) fn cost(&self, means: &Means) -> f64 {
        match means {
            Means::Rule(rule) => self.facts.work.share(rule.domain) * rule.cost(self.facts),
            Means::Edge(carried) => carried.cost(self.facts),
        }
    }

    pub(super) fn error(&self, means: &Means) -> f64 {
        match means {
            // What the scene names counts beside the budget.
            Means::Rule(rule) if rule.named => 0.0,
            Means::Rule(rule) => rule.error(self.facts),
            Means::Edge(carried) => carried.error,
        }
    }

    /// All that a means gives.
    pub(super) fn gives(&self, means: &Means, want: Bits) -> Bits {
        match means {
            Means::Rule(rule) => {
                rule.gives.iter().filter_map(|(q, _)| self.bit((rule.domain, q))).fold(want, Bits::or)
            }
            Means::Edge(_) => want,
        }
    }
}

impl Given<'_> {
    /// Whether a want is met without any means: by an attribute, a constant, the vertex' index, or what is given.
    fn has(&self, (domain, quantity): Want) -> bool {
        let constant = Constant::from_name(quantity);
        if domain == Domain::Texel {
            return constant.is_some_and(|constant| !is_of_the_eye(constant.name()))
                || self.texels.iter().any(|(name, _)| *name == quantity);
        }
        constant.is_some()
            || quantity == "vertex_index"
            || Attribute::all(self.effects).any(|attribute| attribute.name() == quantity)
            || (domain == Domain::Fragment && self.fragments.contains(&quantity))
    }
}

/// Whether a constant is the camera's.
pub(super) fn is_of_the_eye(name: &str) -> bool {
    [Constant::Eye, Constant::ViewProjection].iter().any(|constant| constant.name() == name)
}

/// Every want that some means gives.
fn all_means(facts: &Facts) -> BTreeMap<Want, Vec<Means>> {
    let usable = || rules(facts.setup.effects).filter(|rule| rule.refusal(facts).is_none());
    let open = |edge: &&'static Edge| edge.when.iter().all(|condition| facts.holds(condition) == Some(true));
    let edges: Vec<&'static Edge> = EDGES.iter().filter(open).collect();
    let seen = seen(usable);
    let mut means: BTreeMap<Want, Vec<Means>> = BTreeMap::new();
    for rule in usable() {
        for (quantity, swizzle) in &rule.gives {
            means.entry((rule.domain, quantity)).or_default().push(Means::Rule(rule));
            for edge in edges.iter().filter(|edge| edge.from == rule.domain) {
                let hidden = edge.to == Domain::Texel && seen.contains(quantity);
                let Some(error) = error_on(edge, rule).filter(|_| !hidden) else { continue };
                let numbers = if swizzle.is_empty() { components(rule.returns) } else { swizzle.len() };
                let carried = Carried { edge, quantity, numbers, error };
                carry(means.entry((edge.to, quantity)).or_default(), carried);
            }
        }
    }
    let within = |carried: &Carried| match facts.budget {
        Budget::Exact | Budget::Paper => carried.error == 0.0,
        Budget::Within(most) => carried.error <= most,
    };
    for ways in means.values_mut() {
        ways.retain(|way| !matches!(way, Means::Edge(carried) if !within(carried)));
    }
    means
}

/// How far a rule's quantities are off after an edge; `None` where they do not take it.
fn error_on(edge: &Edge, rule: &Rule) -> Option<f64> {
    match edge.error {
        EdgeError::None => Some(0.0),
        EdgeError::Declared => rule.sampled,
    }
}

/// Add an edge to a want's means. It stands there once: where several rules give the quantity, with the largest of
/// their errors.
fn carry(means: &mut Vec<Means>, carried: Carried) {
    let there = means.iter_mut().find_map(|means| match means {
        Means::Edge(there) if there.edge == carried.edge => Some(there),
        _ => None,
    });
    if let Some(there) = there {
        there.error = there.error.max(carried.error);
    } else {
        means.push(Means::Edge(carried));
    }
}

/// The vertices' quantities that depend on the eye.
fn seen<I: Iterator<Item = &'static Rule>>(rules: impl Fn() -> I) -> BTreeSet<&'static str> {
    let mut seen = BTreeSet::new();
    loop {
        let before = seen.len();
        for rule in rules().filter(|rule| rule.domain == Domain::Vertex) {
            if rule.needs.iter().any(|(need, _)| is_of_the_eye(need) || seen.contains(need)) {
                seen.extend(rule.gives.iter().map(|(quantity, _)| *quantity));
            }
        }
        if seen.len() == before {
            return seen;
        }
    }
}

/// How far each want lies from the inputs: one more than the furthest of its needs, over all means. Wants
/// that cannot be met have no rank.
fn ranks(means: &BTreeMap<Want, Vec<Means>>, given: &Given<'_>) -> Result<BTreeMap<Want, usize>, PlanError> {
    let mut ranks: BTreeMap<Want, usize> = BTreeMap::new();
    // Each round settles at least one more; cycles would never end, so rounds are counted.
    for _ in 0..=means.len() {
        let mut changed = false;
        for (want, ways) in means {
            let rank = ways.iter().filter_map(|way| {
                let open = way.needs().into_iter().filter(|&need| !given.has(need));
                open.into_iter().try_fold(0, |rank: usize, need| Some(rank.max(ranks.get(&need)? + 1)))
            });
            if let Some(rank) = rank.max()
                && ranks.get(want) != Some(&rank)
            {
                ranks.insert(*want, rank);
                changed = true;
            }
        }
        if !changed {
            return Ok(ranks);
        }
    }
    let goals = means.keys().map(|(_, quantity)| *quantity).collect::<Vec<_>>().join(", ");
    Err(PlanError::Circle { goals })
}
