//! Named choices of light that comes through the skin (MODEL 11).

use std::sync::LazyLock;

/// How far light comes beyond which nothing is left of it, in millimetres: 80 lengths (MODEL 11) of the longest that a
/// parameter may be, 50 mm.
pub const FARTHEST: f64 = 4000.0;

/// Distances inside, in millimetres, by which gathered light is told apart. Between two of them light counts for the four around,
/// by the cubic through these over the logarithm of distance, before the second by a line: for lengths from half a millimetre on
/// that is within half a hundredth of how any of it is weakened, and little more than a thousandth below nothing. Beyond the last
/// nothing is left.
pub const NODES: [f64; 12] = [0.0, 0.1, 0.2, 0.4, 0.8, 1.5, 3.0, 5.5, 10.0, 18.0, 32.0, 50.0];

/// Their logarithms, but for the first, which has none.
static LOGARITHMS: LazyLock<[f64; NODES.len()]> = LazyLock::new(|| NODES.map(f64::ln));

/// What light that leaves the mesh so many millimetres away counts for each of [`NODES`].
#[must_use]
pub fn shares(distance: f64) -> [f64; NODES.len()] {
    let mut shares = [0.0; NODES.len()];
    // The first of them that is not nearer; NaN has none.
    let Some(next) = NODES.iter().position(|&node| distance <= node) else { return shares };
    if next <= 1 {
        let share = distance.max(0.0) / NODES[1];
        (shares[0], shares[1]) = (1.0 - share, share);
        return shares;
    }
    // Two nodes to either side, but for the first and the last of those that have a logarithm.
    let first = (next - 2).clamp(1, NODES.len() - 4);
    let (place, places) = (distance.ln(), &LOGARITHMS[first..first + 4]);
    for k in 0..4 {
        let others = places.iter().enumerate().filter(|&(j, _)| j != k);
        shares[first + k] = others.map(|(_, other)| (place - other) / (places[k] - other)).product();
    }
    shares
}

/// The ways that a scene takes (its `[transmission]` table).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct TransmissionChoices {
    /// How far lights travel inside.
    pub method: Method,
}

/// How light finds its way inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// The environment's by a thickness of each vertex; a light's as far as rays tell: from samples, or from the vertices where
    /// a rasteriser interpolates them.
    #[default]
    Thickness,
    /// The same, but that a rasteriser finds how far a light travels inside from its shadow map (Dachsbacher and Stamminger
    /// 2003, Translucent Shadow Maps).
    ShadowMaps,
    /// Of each vertex by rays inward, each of which brings what arrives where it leaves the mesh.
    Gathered,
}

impl Method {
    /// All, in the order of documentation.
    pub const ALL: [Self; 3] = [Self::Thickness, Self::ShadowMaps, Self::Gathered];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thickness => "thickness",
            Self::ShadowMaps => "shadow_maps",
            Self::Gathered => "gathered",
        }
    }
}

impl TransmissionChoices {
    /// Those that a scene file names, each by its table and key.
    #[must_use]
    pub const fn named(&self) -> [(&'static str, &'static str); 1] {
        [("transmission.method", self.method.name())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How light is weakened over a distance, exactly and by its shares.
    fn weakened(distance: f64, length: f64) -> [f64; 2] {
        let exp = |d: f64| (-d / length).exp();
        [exp(distance), NODES.iter().zip(shares(distance)).map(|(node, share)| share * exp(*node)).sum()]
    }

    #[test]
    fn shares_are_those_of_a_cubic_and_light_is_weakened_by_them_as_it_is() {
        for length in [0.05, 0.3, 0.5, 0.52, 0.7, 1.4, 3.7, 11.0, 50.0] {
            for k in 0..=1000 {
                let distance = 0.05 * f64::from(k);
                let [exact, found] = weakened(distance, length);
                // By four nodes around: 3/128 of the fourth difference, up to 0.2. Before the second a line: an eighth of the
                // square of its share of the length.
                let line = if distance < NODES[1] { (NODES[1] / length).powi(2) / 8.0 } else { 0.0 };
                // Of the shortest lengths all fall lies between two nodes.
                let most = f64::max(if length < 0.5 { 0.05 } else { 0.005 }, line);
                assert!(length < 0.5 || found > -0.0012, "{length}: {distance} {found}");
                assert!((exact - found).abs() < most, "{length}: {distance} {exact} {found}");
            }
        }
        for (k, node) in NODES.into_iter().enumerate() {
            let shares = shares(node);
            assert!((0..NODES.len()).all(|j| shares[j] == f64::from(u8::from(j == k))), "{node}: {shares:?}");
        }
        // Rules have the same distances, and fields say so.
        let (sky, light) = (
            include_str!("../shader/rules/term/transmission.wgsl"),
            include_str!("../shader/rules/family/lit.wgsl"),
        );
        for (k, node) in NODES.into_iter().enumerate().skip(1) {
            let weakened = format!("+ transmitted({node:?}, transmission_length) * ");
            let lane = format!("light_NAME_far_light_{}.{};", k / 3, ["x", "y", "z"][k % 3]);
            assert!(sky.contains(&format!("{weakened}far_light_{k};")), "{node}");
            assert!(light.contains(&(weakened + &lane)), "{node}");
            assert!(
                sky.contains(&format!("far_light_{k}: vec3f = 0; "))
                    && sky.contains(&format!(" after {node} mm"))
            );
        }
        for family in [
            include_str!("../shader/rules/family/beam.wgsl"),
            include_str!("../shader/rules/family/lamp.wgsl"),
        ] {
            for (part, [a, b, c]) in NODES.as_chunks().0.iter().enumerate() {
                let told = format!("light_NAME_far_light_{part}: vec3f = 0; ");
                let line = family.lines().find(|line| line.contains(&told)).unwrap();
                assert!(line.ends_with(&format!("after {a}, {b} and {c} mm")), "{line}");
            }
        }
        // Nothing is left from beyond, and what extrapolation puts before the surface lies on it.
        assert!([50.5, f64::INFINITY, f64::NAN].iter().all(|d| shares(*d) == [0.0; NODES.len()]));
        assert_eq!(shares(-1.0)[0], 1.0);
    }
}
