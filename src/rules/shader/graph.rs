//! The graph of quantities under one set of facts: what may be wanted in which domain, and what gives it.

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

/// What gives a quantity: a rule, or an edge from another domain.
#[derive(Clone, Copy, Debug)]
pub(super) enum Producer {
    Rule(&'static Rule),
    Edge(Carried),
}

impl Producer {
    /// What it needs, inputs as well.
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

/// How a want may be met: a hyperedge of the graph, from what a producer needs to what it gives.
#[derive(Debug)]
pub(super) struct Derivation {
    pub(super) producer: Producer,
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
    /// For each want, its derivations.
    derivations: Vec<Vec<Derivation>>,
}

/// The inputs: what nothing need give.
struct Given<'a> {
    /// The names of what vertices have.
    attributes: BTreeSet<&'static str>,
    /// Of fragments.
    fragments: &'a [&'static str],
    /// Of texels.
    texels: Fields,
}

/// Of each want its producers, with what they need that is no input.
type Open = BTreeMap<Want, Vec<(Producer, Vec<Want>)>>;

impl<'a> Graph<'a> {
    pub(super) fn new(facts: &'a Facts, fragments: &'a [&'static str]) -> Result<Self, PlanError> {
        let attributes = Attribute::all(facts.setup.effects).map(Attribute::name).collect();
        let given = Given { attributes, fragments, texels: texel_fields(facts) };
        let with_needs = |producer: Producer| {
            let needs = producer.needs().into_iter().filter(|&need| !given.has(need)).collect();
            (producer, needs)
        };
        let open: Open = producers(facts)
            .into_iter()
            .map(|(want, producers)| (want, producers.into_iter().map(with_needs).collect()))
            .collect();
        let ranks = ranks(&open)?;
        let mut sorted: Vec<Want> = ranks.keys().copied().collect();
        sorted.sort_by_key(|want| (ranks[want], *want));
        let wants: BTreeMap<Want, usize> = sorted.iter().enumerate().map(|(i, want)| (*want, i)).collect();
        let derivation = |at: usize, (producer, needs): &(Producer, Vec<Want>)| -> Option<Derivation> {
            let set = |set: Bits, want: &Want| Some(set.or(&Bits::one(*wants.get(want)?)));
            let needs = needs.iter().try_fold(Bits::default(), set)?;
            Some(Derivation {
                producer: *producer,
                needs,
                gives: gives(producer)
                    .filter_map(|want| wants.get(&want))
                    .fold(Bits::one(at), |all, &one| all.or(&Bits::one(one))),
                cost: cost(facts, producer),
                error: error(facts, producer),
            })
        };
        let of_want =
            |(at, want): (usize, &Want)| open[want].iter().filter_map(|open| derivation(at, open)).collect();
        let derivations = sorted.iter().enumerate().map(of_want).collect();
        Ok(Self { facts, wants, derivations })
    }

    /// A want's number; `None` where nothing gives it.
    pub(super) fn number(&self, want: Want) -> Option<usize> {
        self.wants.get(&want).copied()
    }

    /// The derivations of each want, by its number.
    pub(super) fn derivations(&self) -> &[Vec<Derivation>] {
        &self.derivations
    }
}

/// Operations a fragment.
fn cost(facts: &Facts, producer: &Producer) -> f64 {
    match producer {
        Producer::Rule(rule) => facts.work.share(rule.domain) * rule.cost(facts),
        Producer::Edge(carried) => carried.cost(facts),
    }
}

fn error(facts: &Facts, producer: &Producer) -> f64 {
    match producer {
        // What the scene names counts beside the budget.
        Producer::Rule(rule) if rule.named => 0.0,
        Producer::Rule(rule) => rule.error(facts),
        Producer::Edge(carried) => carried.error,
    }
}

/// What a rule gives; an edge gives what it is taken for.
fn gives(producer: &Producer) -> impl Iterator<Item = Want> {
    let rule = match producer {
        Producer::Rule(rule) => Some(*rule),
        Producer::Edge(_) => None,
    };
    rule.into_iter().flat_map(|rule| rule.gives.iter().map(|(quantity, _)| (rule.domain, *quantity)))
}

impl Given<'_> {
    /// Whether a want is an input: by an attribute, a constant, the vertex' index, or what is given.
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

/// Every want that has a producer, with its producers.
fn producers(facts: &Facts) -> BTreeMap<Want, Vec<Producer>> {
    let usable = || rules(facts.setup.effects).filter(|rule| rule.refusal(facts).is_none());
    let open = |edge: &&'static Edge| edge.when.iter().all(|condition| facts.holds(condition) == Some(true));
    let edges: Vec<&'static Edge> = EDGES.iter().filter(open).collect();
    let seen = seen(usable);
    let mut producers: BTreeMap<Want, Vec<Producer>> = BTreeMap::new();
    for rule in usable() {
        for (quantity, swizzle) in &rule.gives {
            producers.entry((rule.domain, quantity)).or_default().push(Producer::Rule(rule));
            for edge in edges.iter().filter(|edge| edge.from == rule.domain) {
                let hidden = edge.to == Domain::Texel && seen.contains(quantity);
                let Some(error) = error_on(edge, rule).filter(|_| !hidden) else { continue };
                let numbers = if swizzle.is_empty() { components(rule.returns) } else { swizzle.len() };
                let carried = Carried { edge, quantity, numbers, error };
                carry(producers.entry((edge.to, quantity)).or_default(), carried);
            }
        }
    }
    let within = |carried: &Carried| match facts.budget {
        Budget::Exact | Budget::Paper => carried.error == 0.0,
        Budget::Within(most) => carried.error <= most,
    };
    for of_want in producers.values_mut() {
        of_want.retain(|producer| !matches!(producer, Producer::Edge(carried) if !within(carried)));
    }
    producers
}

/// How far a rule's quantities are off after an edge; `None` where they do not take it.
fn error_on(edge: &Edge, rule: &Rule) -> Option<f64> {
    match edge.error {
        EdgeError::None => Some(0.0),
        EdgeError::Declared => rule.sampled,
    }
}

/// Add an edge to a want's producers. It stands there once: where several rules give the quantity, with the largest of
/// their errors.
fn carry(producers: &mut Vec<Producer>, carried: Carried) {
    let there = producers.iter_mut().find_map(|producer| match producer {
        Producer::Edge(there) if there.edge == carried.edge => Some(there),
        _ => None,
    });
    if let Some(there) = there {
        there.error = there.error.max(carried.error);
    } else {
        producers.push(Producer::Edge(carried));
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

/// How far each want lies from the inputs: one more than the furthest of its needs, over all derivations. Wants
/// that cannot be met have no rank.
fn ranks(open: &Open) -> Result<BTreeMap<Want, usize>, PlanError> {
    let mut ranks: BTreeMap<Want, usize> = BTreeMap::new();
    // Each round settles at least one more; cycles would never end, so rounds are counted.
    for _ in 0..=open.len() {
        let mut changed = false;
        for (want, producers) in open {
            let rank = producers.iter().filter_map(|(_, needs)| {
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
    let goals = open.keys().map(|(_, quantity)| *quantity).collect::<Vec<_>>().join(", ");
    Err(PlanError::Circle { goals })
}
