//! One fragment: from texels and interpolated values to colour and haze (listing 3-4), in both forms.

use super::cube::Cube;
use super::{V3, dot, scaled, sum, unit};

/// Which reading of the listing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    Listing,
    Corrected,
}

/// Where S.z comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Silhouette {
    Vertex,
    Fragment,
    Bumped,
}

impl Form {
    pub(crate) const ALL: [Self; 2] = [Self::Listing, Self::Corrected];
}

impl Silhouette {
    pub(crate) const ALL: [Self; 3] = [Self::Vertex, Self::Fragment, Self::Bumped];
}

/// Where the model may be read in another way than its first version.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Variant {
    /// The cubes are looked up along N, and bumps show under the key light alone.
    pub(crate) smooth_lookups: bool,
    /// The third row of DappleXf, in a world that the environment is turned in: S.w is made of N and not given.
    pub(crate) dapple_axis: Option<V3>,
    /// The rim is interpolated from a triangle's corners, and not a power of S.z.
    pub(crate) interpolated_rim: bool,
}

/// The model's fourteen constants, a value a channel; those that have one value hold it three times.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants {
    pub(crate) base_weight: V3,
    pub(crate) rim_weight: V3,
    pub(crate) rim_exponent: V3,
    pub(crate) hilite: V3,
    pub(crate) reflection: V3,
    pub(crate) side_specular: V3,
    pub(crate) occlusion: V3,
    pub(crate) normal_strength: V3,
    pub(crate) specular_lobe: V3,
    pub(crate) environment_rotation: V3,
    pub(crate) haze_weight: V3,
    pub(crate) key_azimuth: V3,
    pub(crate) key_elevation: V3,
    pub(crate) key_color: V3,
}

/// Their names, and which may have a value a channel.
pub(crate) const NAMES: [(&str, bool); 14] = [
    ("base_weight", true),
    ("rim_weight", true),
    ("rim_exponent", false),
    ("hilite", true),
    ("reflection", true),
    ("side_specular", true),
    ("occlusion", false),
    ("normal_strength", false),
    ("specular_lobe", false),
    ("environment_rotation", false),
    ("haze_weight", false),
    ("key_azimuth", false),
    ("key_elevation", false),
    ("key_color", true),
];

impl Constants {
    /// The defaults of a form, but with the key light dark.
    pub(crate) fn defaults(form: Form) -> Self {
        let listing = form == Form::Listing;
        Self {
            base_weight: [if listing { 0.0 } else { 1.0 }; 3],
            rim_weight: [if listing { 1.0 } else { 0.5 }; 3],
            rim_exponent: [2.0; 3],
            hilite: [0.7; 3],
            reflection: [0.02; 3],
            side_specular: [1.0; 3],
            occlusion: [1.0; 3],
            normal_strength: [1.0; 3],
            specular_lobe: [32.0; 3],
            environment_rotation: [0.0; 3],
            haze_weight: [1.0; 3],
            key_azimuth: [0.0; 3],
            key_elevation: [45.0; 3],
            key_color: [0.0; 3],
        }
    }

    pub(crate) fn of(&mut self, name: &str) -> &mut V3 {
        match name {
            "base_weight" => &mut self.base_weight,
            "rim_weight" => &mut self.rim_weight,
            "rim_exponent" => &mut self.rim_exponent,
            "hilite" => &mut self.hilite,
            "reflection" => &mut self.reflection,
            "side_specular" => &mut self.side_specular,
            "occlusion" => &mut self.occlusion,
            "normal_strength" => &mut self.normal_strength,
            "specular_lobe" => &mut self.specular_lobe,
            "environment_rotation" => &mut self.environment_rotation,
            "haze_weight" => &mut self.haze_weight,
            "key_azimuth" => &mut self.key_azimuth,
            "key_elevation" => &mut self.key_elevation,
            "key_color" => &mut self.key_color,
            other => panic!("the witness knows no {other}"),
        }
    }
}

/// What a fragment is given: interpolated values and texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inputs {
    /// The normal map's rgb, in [0, 1].
    pub(crate) texel: V3,
    /// T, B and N.
    pub(crate) frame: [V3; 3],
    /// V, from the eye to the surface.
    pub(crate) view: V3,
    /// S.x
    pub(crate) open: f64,
    /// S.z
    pub(crate) silhouette: f64,
    /// S.w
    pub(crate) dapple: f64,
    pub(crate) albedo: V3,
    pub(crate) specular: f64,
    pub(crate) attenuator: f64,
}

/// What is left of it before any constant counts: n is along `base + normal_strength bump`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub(crate) base: V3,
    pub(crate) bump: V3,
    pub(crate) normal: V3,
    pub(crate) view: V3,
    pub(crate) open: f64,
    pub(crate) silhouette: f64,
    /// S.z at the corners of its triangle, and their barycentric coordinates.
    pub(crate) corners: [V3; 2],
    pub(crate) dapple: f64,
    pub(crate) albedo: V3,
    pub(crate) specular: f64,
    pub(crate) attenuator: f64,
}

impl Inputs {
    pub(crate) fn surface(&self, form: Form) -> Surface {
        let [t, b, n] = self.frame;
        // The listing takes the texel as it is; what decodes to nothing, or is no number, is the smooth normal.
        let decoded = match form {
            Form::Listing => self.texel,
            Form::Corrected => unit(self.texel.map(|x| 2.0 * x - 1.0))
                .map_or([0.0, 0.0, 1.0], |_| self.texel.map(|x| 2.0 * x - 1.0)),
        };
        let (view, dapple) = match form {
            Form::Listing => (self.view, self.dapple),
            Form::Corrected => (unit(self.view).unwrap_or([0.0, 0.0, -1.0]), self.dapple.max(0.0)),
        };
        Surface {
            base: scaled(decoded[2], n),
            bump: sum(scaled(decoded[0], t), scaled(decoded[1], b)),
            normal: n,
            view,
            open: self.open,
            silhouette: self.silhouette,
            corners: [[self.silhouette; 3], [1.0, 0.0, 0.0]],
            dapple,
            albedo: self.albedo,
            specular: self.specular,
            attenuator: self.attenuator,
        }
    }
}

/// What shines.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    /// E_d
    pub(crate) irradiance: Cube,
    /// E_s at ascending Phong exponents, each the same ratio above the one before.
    pub(crate) lobes: Vec<(f64, Cube)>,
    /// E_h
    pub(crate) hilite: Cube,
}

impl Lights {
    /// E_s at an exponent: a Catmull-Rom spline in its logarithm, with a parabola's slopes at the ends.
    fn lobe(&self, exponent: f64, d: V3) -> [f64; 4] {
        let values: Vec<[f64; 4]> = self.lobes.iter().map(|(_, cube)| cube.along(d)).collect();
        let last = values.len() - 1;
        if last == 0 {
            return values[0];
        }
        let step = (self.lobes[1].0 / self.lobes[0].0).log2();
        let at = ((exponent / self.lobes[0].0).log2() / step).clamp(0.0, last as f64);
        let i = (at as usize).min(last - 1);
        let x = at - i as f64;
        std::array::from_fn(|c| {
            let v = |k: usize| values[k][c];
            let slope = |k: usize| match (k, last) {
                (_, 1) => v(1) - v(0),
                (0, _) => -1.5 * v(0) + 2.0 * v(1) - 0.5 * v(2),
                (k, last) if k == last => 1.5 * v(k) - 2.0 * v(k - 1) + 0.5 * v(k - 2),
                (k, _) => 0.5 * (v(k + 1) - v(k - 1)),
            };
            let (x2, x3) = (x * x, x * x * x);
            v(i) * (2.0 * x3 - 3.0 * x2 + 1.0)
                + v(i + 1) * (3.0 * x2 - 2.0 * x3)
                + slope(i) * (x3 - 2.0 * x2 + x)
                + slope(i + 1) * (x3 - x2)
        })
    }
}

/// A shaded fragment, and what it was made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shaded {
    pub(crate) rgba: [f64; 4],
    pub(crate) n: V3,
    pub(crate) n_dot_v: f64,
    pub(crate) rim: f64,
    pub(crate) reflection: V3,
    /// E_d(n), E_s(n), E_s(R), E_h(V).
    pub(crate) lookups: [[f64; 4]; 4],
}

/// S.z^p, with 0^p = 0 and 0^0 = 1.
pub(crate) fn power(z: f64, p: f64) -> f64 {
    if z > 0.0 {
        z.powf(p)
    } else if p == 0.0 {
        1.0
    } else {
        0.0
    }
}

/// Listing 3-4 over one surface.
pub(crate) fn shade(
    form: Form,
    at: Silhouette,
    variant: Variant,
    f: &Surface,
    lights: &Lights,
    k: &Constants,
) -> Shaded {
    let v = f.view;
    let m = sum(f.base, scaled(k.normal_strength[0], f.bump));
    let n = match form {
        Form::Listing => m,
        Form::Corrected => unit(m).or_else(|| unit(f.normal)).unwrap_or(scaled(-1.0, v)),
    };
    let q = dot(n, v);
    let along = if variant.smooth_lookups { f.normal } else { n };
    let facing = dot(along, v);
    let reflection = match form {
        // As printed: the listing scales V, not n.
        Form::Listing => sum(scaled(facing, v), scaled(-2.0, along)),
        Form::Corrected => sum(v, scaled(-2.0 * facing, along)),
    };
    let z = if at == Silhouette::Bumped { 1.0 - q.abs().min(1.0) } else { f.silhouette };
    let exponent = k.rim_exponent[0];
    let [corners, shares] = f.corners;
    let rim = if variant.interpolated_rim {
        (0..3).map(|i| shares[i] * power(corners[i], exponent)).sum()
    } else {
        power(z, exponent)
    };
    let occ = 1.0 - k.occlusion[0] * (1.0 - f.open);

    // World to environment: back by the turn about +Y.
    let (sin, cos) = k.environment_rotation[0].to_radians().sin_cos();
    let turned = |d: V3| [cos * d[0] - sin * d[2], d[1], sin * d[0] + cos * d[2]];
    let dapple = match (variant.dapple_axis, form) {
        (None, _) => f.dapple,
        (Some(axis), Form::Listing) => dot(axis, turned(f.normal)),
        (Some(axis), Form::Corrected) => dot(axis, turned(f.normal)).max(0.0),
    };
    let exponent = k.specular_lobe[0];
    let lookups = [
        lights.irradiance.along(turned(along)),
        lights.lobe(exponent, turned(along)),
        lights.lobe(exponent, turned(reflection)),
        lights.hilite.along(turned(v)),
    ];
    let [e_d, e_s, e_r, e_h] = lookups;

    let (azimuth, elevation) = (k.key_azimuth[0].to_radians(), k.key_elevation[0].to_radians());
    let towards = [elevation.cos() * azimuth.sin(), elevation.sin(), elevation.cos() * azimuth.cos()];
    let key = dot(n, towards).max(0.0) - dot(f.normal, towards).max(0.0);

    let colour = |c: usize| {
        f.albedo[c] * e_d[c] * occ * (k.base_weight[c] + k.rim_weight[c] * rim)
            + k.side_specular[c] * f.specular * e_s[c]
            + k.hilite[c] * occ * rim * f.attenuator * e_h[c]
            + k.reflection[c] * dapple * e_r[c]
            + k.key_color[c] * f.albedo[c] * key
    };
    let haze = k.haze_weight[0] * dapple * f.attenuator * e_r[3];
    Shaded { rgba: [colour(0), colour(1), colour(2), haze], n, n_dot_v: q, rim, reflection, lookups }
}
