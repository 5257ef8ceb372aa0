//! Domains: where quantities are computed. Edges: how a quantity of one domain comes to another.
//!
//! A mesh's vertices, the texels of its UV atlas, and fragments: each evaluates rules of its own. (A fourth domain, the
//! pixel, is the mean of its fragments or samples; no rule is evaluated there.) An edge has a cost and an error as a
//! rule has, so that the search decides where a quantity is best computed.

/// Where a rule is evaluated, in the order of evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Domain {
    /// Once a vertex.
    Vertex,
    /// Once a texel of the UV atlas that the mesh covers. A texel is lit, not seen: nothing there depends on the eye.
    Texel,
    /// Once a fragment or stored sample.
    Fragment,
}

impl Domain {
    /// Every domain.
    pub const ALL: [Self; 3] = [Self::Vertex, Self::Texel, Self::Fragment];

    /// The name in rules' files, and of the built-in rules' folder.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::Texel => "texel",
            Self::Fragment => "fragment",
        }
    }

    /// The domain of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|domain| domain.name() == name)
    }
}

/// How often each domain is evaluated for an image; only the ratios count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Work {
    /// Vertices of the mesh.
    pub vertices: f64,
    /// Texels of the atlas that the mesh covers.
    pub texels: f64,
    /// Fragments of the image.
    pub fragments: f64,
}

impl Default for Work {
    /// A character's mesh has about a vertex for every four pixels that it covers; its atlas about a texel for each.
    fn default() -> Self {
        Self { vertices: 1.0, texels: 4.0, fragments: 4.0 }
    }
}

impl Work {
    /// How much an evaluation in a domain counts beside a fragment's. Counts that are no counts are the default's.
    #[must_use]
    pub fn share(&self, domain: Domain) -> f64 {
        let counts = [self.vertices, self.texels, self.fragments];
        let sound = counts.iter().all(|count| count.is_finite() && *count >= 0.0) && self.fragments > 0.0;
        let Self { vertices, texels, fragments } = if sound { *self } else { Self::default() };
        match domain {
            Domain::Vertex => vertices / fragments,
            Domain::Texel => texels / fragments,
            Domain::Fragment => 1.0,
        }
    }
}

/// A way of a quantity from one domain to another.
#[derive(Debug, PartialEq)]
pub struct Edge {
    /// What happens to the quantity there.
    pub name: &'static str,
    /// Where the quantity is computed.
    pub from: Domain,
    /// Where it comes to.
    pub to: Domain,
    /// Operations that it takes at each place where it arrives.
    pub cost: f64,
    /// Operations for each of its numbers.
    pub cost_a_number: f64,
    /// How far it is off.
    pub error: EdgeError,
    /// Conditions on the facts, all of which must hold.
    pub when: &'static [&'static str],
    /// Quantities that it needs beside, where it arrives.
    pub beside: &'static [&'static str],
}

/// How far an edge is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeError {
    /// By nothing but rounding.
    None,
    /// By what the quantity's rule declares in its line `sampled`; a quantity whose rule has none does not take the edge.
    Declared,
}

/// Texture coordinates, by which maps are looked up, and texels where the atlas has none of its own.
pub const UV: &str = "vertex_uv";

/// Texture coordinates of the atlas' own, by which texels are found.
pub const ATLAS_UV: &str = "vertex_atlas_uv";

/// The chart of the atlas that a point lies in, counted from 1: a fragment looks up texels of its own chart.
pub const CHART: &str = "vertex_chart";

/// Every edge from one domain to another. Passes from texels to texels are rules of their own (`pass`): each costs
/// [`TAP_COST`] a tap and direction beside its kernel.
pub const EDGES: [Edge; 4] = [
    Edge {
        name: "interpolated",
        from: Domain::Vertex,
        to: Domain::Fragment,
        cost: 0.0,
        cost_a_number: 1.0,
        error: EdgeError::None,
        when: &[],
        beside: &[],
    },
    // The mesh is drawn with its texture coordinates in the atlas as positions.
    Edge {
        name: "rasterised",
        from: Domain::Vertex,
        to: Domain::Texel,
        cost: 0.0,
        cost_a_number: 1.0,
        error: EdgeError::None,
        when: &["atlas"],
        beside: &[],
    },
    SAMPLED,
    Edge { when: &["atlas", "own_atlas_uvs"], beside: &[ATLAS_UV, CHART], ..SAMPLED },
];

/// Four texels are read and weighed in the shader, as rules that filter maps there do.
const SAMPLED: Edge = Edge {
    name: "sampled",
    from: Domain::Texel,
    to: Domain::Fragment,
    cost: 34.0,
    cost_a_number: 0.0,
    error: EdgeError::Declared,
    when: &["atlas", "!own_atlas_uvs"],
    beside: &[UV, CHART],
};

/// Operations that a pass takes for a tap beside its kernel: two texels are read and weighed.
pub const TAP_COST: f64 = 16.0;
/// Directions of a pass: along u, then along v.
pub const DIRECTIONS: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::Facts;

    #[test]
    fn a_vertex_counts_a_quarter_of_a_fragment_by_default_whatever_the_counts() {
        assert_eq!(Domain::ALL.map(|domain| Work::default().share(domain)), [0.25, 1.0, 1.0]);
        let broken = Work { vertices: f64::NAN, texels: 1.0, fragments: 0.0 };
        assert_eq!(broken.share(Domain::Texel), 1.0);
        assert_eq!(Work { texels: 1.0, ..Work::default() }.share(Domain::Texel), 0.25);
    }

    #[test]
    fn edges_lead_onwards_and_know_their_conditions() {
        for edge in &EDGES {
            assert!(edge.from < edge.to, "{}", edge.name);
            assert!(edge.when.iter().all(|condition| Facts::default().holds(condition).is_some()));
        }
        assert_eq!(Domain::ALL.map(|domain| Domain::from_name(domain.name())), Domain::ALL.map(Some));
    }
}
