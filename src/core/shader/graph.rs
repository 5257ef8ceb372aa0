//! The graph of quantities under one set of facts: what may be wanted in which domain, and the means that give it.

use std::collections::{BTreeMap, BTreeSet};

use super::bits::Bits;
use super::domain::{Domain, EDGES, Edge, EdgeError};
use super::emit::{Fields, texel_fields};
use super::facts::{Budget, Facts};
use super::quantity::{Attribute, Constant};
use super::rule::{Rule, rules};
use super::search::{PlanError, components};

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

/// A means within the graph.
#[derive(Debug)]
pub(super) struct Way {
    pub(super) means: Means,
    /// The wants of it that are not there already.
    pub(super) needs: Bits,
    /// All that it gives.
    pub(super) gives: Bits,
    /// Operations a fragment.
    pub(super) cost: f64,
    /// How far it is off, relative to white.
    pub(super) error: f64,
}

/// The graph.
pub(super) struct Graph<'a> {
    pub(super) facts: &'a Facts,
    /// The wants, each with its rank: what lies further from the inputs has the greater number.
    wants: BTreeMap<Want, usize>,
    /// For each want, the ways to it.
    ways: Vec<Vec<Way>>,
}

/// What is there without any means.
struct Given<'a> {
    /// The names of what vertices have.
    attributes: BTreeSet<&'static str>,
    /// Of fragments.
    fragments: &'a [&'static str],
    /// Of texels.
    texels: Fields,
}

/// Of each want the means that give it, with what they need that is not there already.
type Open = BTreeMap<Want, Vec<(Means, Vec<Want>)>>;

impl<'a> Graph<'a> {
    pub(super) fn new(facts: &'a Facts, fragments: &'a [&'static str]) -> Result<Self, PlanError> {
        let attributes = Attribute::all(facts.setup.effects).map(Attribute::name).collect();
        let given = Given { attributes, fragments, texels: texel_fields(facts) };
        let open = |means: Means| {
            let needs = means.needs().into_iter().filter(|&need| !given.has(need)).collect();
            (means, needs)
        };
        let means: Open = all_means(facts)
            .into_iter()
            .map(|(want, means)| (want, means.into_iter().map(open).collect()))
            .collect();
        let ranks = ranks(&means)?;
        let mut sorted: Vec<Want> = ranks.keys().copied().collect();
        sorted.sort_by_key(|want| (ranks[want], *want));
        let wants: BTreeMap<Want, usize> = sorted.iter().enumerate().map(|(i, want)| (*want, i)).collect();
        let way = |at: usize, (means, needs): &(Means, Vec<Want>)| -> Option<Way> {
            let set = |set: Bits, want: &Want| Some(set.or(&Bits::one(*wants.get(want)?)));
            let needs = needs.iter().try_fold(Bits::default(), set)?;
            Some(Way {
                means: *means,
                needs,
                gives: gives(means)
                    .filter_map(|want| wants.get(&want))
                    .fold(Bits::one(at), |all, &one| all.or(&Bits::one(one))),
                cost: cost(facts, means),
                error: error(facts, means),
            })
        };
        let ways = |(at, want): (usize, &Want)| means[want].iter().filter_map(|open| way(at, open)).collect();
        let ways = sorted.iter().enumerate().map(ways).collect();
        Ok(Self { facts, wants, ways })
    }

    /// A want's number; `None` where nothing gives it.
    pub(super) fn number(&self, want: Want) -> Option<usize> {
        self.wants.get(&want).copied()
    }

    /// The ways to each want, by its number.
    pub(super) fn ways(&self) -> &[Vec<Way>] {
        &self.ways
    }
}

/// Operations a fragment.
fn cost(facts: &Facts, means: &Means) -> f64 {
    match means {
        Means::Rule(rule) => facts.work.share(rule.domain) * rule.cost(facts),
        Means::Edge(carried) => carried.cost(facts),
    }
}

fn error(facts: &Facts, means: &Means) -> f64 {
    match means {
        // What the scene names counts beside the budget.
        Means::Rule(rule) if rule.named => 0.0,
        Means::Rule(rule) => rule.error(facts),
        Means::Edge(carried) => carried.error,
    }
}

/// What a rule gives; an edge gives what it is taken for.
fn gives(means: &Means) -> impl Iterator<Item = Want> {
    let rule = match means {
        Means::Rule(rule) => Some(*rule),
        Means::Edge(_) => None,
    };
    rule.into_iter().flat_map(|rule| rule.gives.iter().map(|(quantity, _)| (rule.domain, *quantity)))
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
            || self.attributes.contains(quantity)
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
fn ranks(means: &Open) -> Result<BTreeMap<Want, usize>, PlanError> {
    let mut ranks: BTreeMap<Want, usize> = BTreeMap::new();
    // Each round settles at least one more; cycles would never end, so rounds are counted.
    for _ in 0..=means.len() {
        let mut changed = false;
        for (want, ways) in means {
            let rank = ways.iter().filter_map(|(_, needs)| {
                needs.iter().try_fold(0, |rank: usize, need| Some(rank.max(ranks.get(need)? + 1)))
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
