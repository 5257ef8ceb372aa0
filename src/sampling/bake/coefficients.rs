//! Light as the coefficients of spherical harmonics: L_lm = integral of L(w) Y_lm(w) (MODEL 10).

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::harmonics::{CONSTANT, Order, open_transfer, scale, unscaled};
use crate::scene::maps::{Environment, Map};

/// Nodes of the Gauss-Legendre rule over a row of a panorama: what is integrated is a sum of sines of up to 6 times the
/// polar angle, of which these nodes leave 1e-13 were one row the whole sphere.
const NODES: usize = 16;

/// Coefficients of the light around, rgb, in the world's orientation.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    order: Order,
    rgb: Vec<[f64; 3]>,
}

impl Coefficients {
    /// Those of an environment, its rotation and intensity applied. Each of its panorama's texels counts as evenly
    /// bright, and the functions are integrated over it: of a constant environment only the first number is not 0.
    /// All cores.
    #[must_use]
    pub fn of(environment: &Environment, order: Order) -> Self {
        let light = Self { order, rgb: project(&environment.panorama, order) };
        light.turned(environment.rotation_degrees.to_radians()).times(environment.intensity)
    }

    /// These numbers, as many as `order` has functions; missing ones are 0.
    #[must_use]
    pub fn new(order: Order, mut rgb: Vec<[f64; 3]>) -> Self {
        rgb.resize(order.functions(), [0.0; 3]);
        Self { order, rgb }
    }

    /// How many bands there are.
    #[must_use]
    pub fn order(&self) -> Order {
        self.order
    }

    /// The numbers, by index l² + l + m.
    #[must_use]
    pub fn rgb(&self) -> &[[f64; 3]] {
        &self.rgb
    }

    /// The first bands alone; those that it has, where `order` is higher.
    #[must_use]
    pub fn truncated(&self, order: Order) -> Self {
        let order = order.min(self.order);
        Self { order, rgb: self.rgb[..order.functions()].to_vec() }
    }

    /// A number of times as bright.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        self.rgb.iter_mut().flatten().for_each(|x| *x *= factor);
        self
    }

    /// The light turned by an angle about +Y, by the right-hand rule: L'(w) = L(Ry^-1 w).
    #[must_use]
    pub fn turned(&self, radians: f64) -> Self {
        self.with_pairs(|m, cosine, sine| {
            let (s, c) = (m * radians).sin_cos();
            [cosine * c - sine * s, cosine * s + sine * c]
        })
    }

    /// The derivative of [`Self::turned`] by the angle.
    #[must_use]
    pub fn turning(&self, radians: f64) -> Self {
        self.with_pairs(|m, cosine, sine| {
            let (s, c) = (m * radians).sin_cos();
            [-m * (cosine * s + sine * c), m * (cosine * c - sine * s)]
        })
    }

    /// Each pair of m > 0 and -m replaced by what `pair` makes of it; of m = 0, which no turn moves, by the first
    /// number that it makes of the coefficient and 0.
    fn with_pairs(&self, pair: impl Fn(f64, f64, f64) -> [f64; 2]) -> Self {
        let mut rgb = vec![[0.0; 3]; self.rgb.len()];
        for l in 0..self.order.bands() {
            let middle = l * l + l;
            for c in 0..3 {
                rgb[middle][c] = pair(0.0, self.rgb[middle][c], 0.0)[0];
                for m in 1..=l {
                    let turned = pair(m as f64, self.rgb[middle + m][c], self.rgb[middle - m][c]);
                    [rgb[middle + m][c], rgb[middle - m][c]] = turned;
                }
            }
        }
        Self { order: self.order, rgb }
    }

    /// The mean radiance over the sphere, L_00 Y_00.
    #[must_use]
    pub fn mean(&self) -> [f64; 3] {
        self.rgb[0].map(|x| x * CONSTANT)
    }

    /// Irradiance over pi of an unoccluded surface with that normal (any length): a constant light of 1 gives 1. Not
    /// floored at 0, below which a truncated series may fall.
    #[must_use]
    pub fn irradiance(&self, normal: [f64; 3]) -> [f64; 3] {
        self.through(&open_transfer(self.order, normal))
    }

    /// What arrives through a transfer vector, sum T_lm L_lm, over the bands that both have.
    #[must_use]
    pub fn through<T: Copy + Into<f64>>(&self, transfer: &[T]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (&t, light) in transfer.iter().zip(&self.rgb) {
            (0..3).for_each(|c| sum[c] += t.into() * light[c]);
        }
        sum
    }
}

/// The coefficients of a panorama as its file has it.
fn project(map: &Map<3>, order: Order) -> Vec<[f64; 3]> {
    let (bands, functions) = (order.bands(), order.functions());
    if map.texels.is_empty() {
        return vec![[0.0; 3]; functions];
    }
    let (height, step) = (map.height as f64, TAU / map.width as f64);
    let nodes = gauss_legendre();
    // Column x spans the azimuths -(x + 1) step to -x step, as u = 0 looks along +Z and grows towards -X.
    let waves: Vec<Vec<f64>> = (0..map.width)
        .map(|x| {
            let middle = -(x as f64 + 0.5) * step;
            let wave = |m: i32| {
                let angle = f64::from(m.abs()) * middle;
                if m < 0 { angle.sin() } else { angle.cos() }
            };
            (1 - bands as i32..bands as i32).map(wave).collect()
        })
        .collect();
    let row = |(y, texels): (usize, &[[f32; 3]])| {
        let mut around = vec![[0.0; 3]; 2 * bands - 1];
        for (texel, wave) in texels.iter().zip(&waves) {
            let texel = texel.map(f64::from);
            for (sum, wave) in around.iter_mut().zip(wave) {
                (0..3).for_each(|c| sum[c] += wave * texel[c]);
            }
        }
        // Along the meridian of azimuth 0 cosines are 1: sin^m times Legendre functions.
        let mut down = vec![0.0; functions];
        for (node, weight) in nodes {
            let (sine, cosine) = ((y as f64 + 0.5 + 0.5 * node) / height * PI).sin_cos();
            let weight = weight * 0.5 * PI / height * sine;
            unscaled(bands, [0.0, cosine, sine], |x| x, |i, value| down[i] += weight * value);
        }
        (around, down)
    };
    // Rows are added in their order, for any number of threads.
    let rows: Vec<_> = map.texels.par_chunks_exact(map.width).enumerate().map(row).collect();
    let mut rgb = vec![[0.0; 3]; functions];
    for (around, down) in rows {
        for (i, (l, m)) in order.of_each().enumerate() {
            let along = down[l * l + l + m.unsigned_abs() as usize];
            (0..3).for_each(|c| rgb[i][c] += along * around[(m + bands as i32 - 1) as usize][c]);
        }
    }
    for (value, (l, m)) in rgb.iter_mut().zip(order.of_each()) {
        // The mean of a wave over a column is its value in the middle times this width.
        let half = 0.5 * f64::from(m.abs());
        let width = if m == 0 { step } else { (half * step).sin() / half };
        *value = value.map(|x| x * width * scale(l, m));
    }
    rgb
}

/// Nodes and weights of the Gauss-Legendre rule over [-1, 1], by Newton's method from Chebyshev's nodes.
fn gauss_legendre() -> [(f64, f64); NODES] {
    std::array::from_fn(|k| {
        let mut x = -((k as f64 + 0.75) / (NODES as f64 + 0.5) * PI).cos();
        let mut slope = 1.0;
        // Convergence is quadratic from an error of 1e-3: three steps do, and two more cost nothing.
        for _ in 0..5 {
            let (mut before, mut own) = (1.0, x);
            for l in 2..=NODES {
                let l = l as f64;
                (before, own) = (own, ((2.0 * l - 1.0) * x * own - (l - 1.0) * before) / l);
            }
            slope = NODES as f64 * (x * own - before) / (x * x - 1.0);
            x -= own / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::harmonics::basis;
    use crate::scene::maps::Spots;

    fn environment(width: usize, height: usize, texel: impl Fn(usize, usize) -> [f32; 3]) -> Environment {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Environment {
            panorama: Map { width, height, texels },
            rotation_degrees: 0.0,
            intensity: 1.0,
            spots: Spots::default(),
        }
    }

    fn assert_near(a: &Coefficients, b: &Coefficients, bound: f64) {
        let pairs = a.rgb().iter().flatten().zip(b.rgb().iter().flatten());
        pairs.enumerate().for_each(|(i, (a, b))| assert!((a - b).abs() <= bound, "{i}: {a} {b}"));
    }

    #[test]
    fn a_constant_light_has_only_the_first_coefficient_and_lights_every_surface_alike() {
        for (width, height) in [(1, 1), (2, 1), (7, 5), (64, 32)] {
            let light = Coefficients::of(&environment(width, height, |_, _| [1.0, 0.5, 2.0]), Order::MOST);
            let mean = light.mean();
            // The rule's 1e-13, and the sums' rounding.
            assert!((0..3).all(|c| (mean[c] - [1.0, 0.5, 2.0][c]).abs() < 1e-12), "{mean:?}");
            assert!(light.rgb()[1..].iter().flatten().all(|x| x.abs() < 1e-12), "{light:?}");
            let lit = light.irradiance([0.48, -0.6, 0.64]);
            assert!((0..3).all(|c| (lit[c] - [1.0, 0.5, 2.0][c]).abs() < 1e-12), "{lit:?}");
        }
    }

    #[test]
    fn a_small_bright_texel_is_a_light_from_where_the_lookup_finds_it() {
        use crate::bake::panorama::Radiance;
        let (width, height) = (256, 128);
        for (x, y, rotation) in [(3, 40, 0.0), (100, 7, 0.0), (130, 64, 35.0), (250, 120, -170.0)] {
            let mut environment =
                environment(width, height, |a, b| [f32::from(u8::from(a == x && b == y)); 3]);
            environment.rotation_degrees = rotation;
            environment.intensity = 3.0;
            let (u, v) = ((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
            let (azimuth, polar) = (-u * TAU + rotation.to_radians(), v * PI);
            let d = [polar.sin() * azimuth.sin(), polar.cos(), polar.sin() * azimuth.cos()];
            assert!((Radiance::new(&environment).along(d)[0] - 3.0).abs() < 1e-9);
            let edge = |y: usize| (y as f64 / height as f64 * PI).cos();
            let flux = 3.0 * (edge(y) - edge(y + 1)) * TAU / width as f64;
            let want = basis(Order::MOST, d).into_iter().map(|value| [flux * value; 3]).collect();
            let got = Coefficients::of(&environment, Order::MOST);
            // A texel is 0.025 wide: functions of 5 waves curve by (5 * 0.025)^2 / 24 over it.
            assert_near(&got, &Coefficients::new(Order::MOST, want), 2e-3 * flux);
        }
    }

    #[test]
    fn turning_there_and_back_changes_nothing_and_the_derivative_is_that_of_finite_differences() {
        let light =
            environment(8, 4, |x, y| [(x * y) as f32, (x + 3 * y) as f32 % 5.0, 1.0 / (1 + x) as f32]);
        let light = Coefficients::of(&light, Order::MOST);
        for angle in [0.0, 0.3, -2.5, 40.0] {
            // Roundings of numbers up to 100.
            assert_near(&light.turned(angle).turned(-angle), &light, 1e-12);
            let step = 1e-5;
            let (after, before) = (light.turned(angle + step), light.turned(angle - step));
            let pairs = after.rgb().iter().zip(before.rgb());
            let slope = pairs.map(|(a, b)| std::array::from_fn(|c| (a[c] - b[c]) / (2.0 * step))).collect();
            // Third derivatives of 5^3 times 100 over 6 steps squared, and 1e-14 over a step.
            assert_near(&light.turning(angle), &Coefficients::new(Order::MOST, slope), 1e-6);
        }
        assert_eq!(light.truncated(Order::new(3).unwrap()).rgb(), &light.rgb()[..9]);
    }

    #[test]
    fn a_turned_panorama_is_the_panorama_turned() {
        // By whole texels, so that both are the same light.
        let texel = |x: usize, y: usize| [(x * 7 + y) as f32 % 3.0, x as f32, (y * y) as f32];
        let still = environment(12, 6, texel);
        // A right-handed turn about +Y takes what was at -Z (the centre) to -X (the left quarter).
        let shifted = environment(12, 6, |x, y| texel((x + 3) % 12, y));
        let turned = Environment { rotation_degrees: 90.0, ..still };
        let [a, b] = [turned, shifted].map(|light| Coefficients::of(&light, Order::MOST));
        // Roundings of sums up to 200.
        assert_near(&a, &b, 1e-11);
    }

    #[test]
    fn nothing_in_a_panorama_makes_a_number_that_is_not_finite() {
        let bright = environment(1, 1, |_, _| [65504.0, 0.0, 1e-30]);
        let black = environment(5, 3, |_, _| [0.0; 3]);
        let empty = environment(0, 0, |_, _| [0.0; 3]);
        for light in [bright, black.clone(), empty] {
            let light = Coefficients::of(&light, Order::MOST);
            assert!(light.rgb().iter().flatten().all(|x| x.is_finite()), "{light:?}");
            assert!(light.irradiance([0.0; 3]).iter().all(|x| x.is_finite()));
        }
        assert!(Coefficients::of(&black, Order::MOST).rgb().iter().flatten().all(|&x| x == 0.0));
    }
}
