//! Where light falls through leaves from: the listing's `DappleXf`, of which S.w takes the third row.

/// S.w = axis . N: the third row of `DappleXf`, in the world, before `environment_rotation` turns it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Dapple {
    /// The axis' numbers, as bits, so that setups can be compared and hashed.
    axis: [u32; 3],
    turns: bool,
    /// Whether it stands in the world, whatever turns the environment.
    in_world: bool,
}

impl Default for Dapple {
    fn default() -> Self {
        Self::LEAVES_AHEAD
    }
}

impl Dapple {
    /// `DappleXf` the identity: light from the world's +Z, whatever turns the environment. What a scene has that does not
    /// say where its light falls through leaves from.
    pub const LEAVES_AHEAD: Self = Self { axis: [0, 0, 1.0_f32.to_bits()], turns: false, in_world: true };

    /// Of the third row of `DappleXf` in the environment's frame, which stands in the world turned about +Y by
    /// `degrees`; `turns` where `environment_rotation` is free.
    #[must_use]
    pub fn new([x, y, z]: [f64; 3], degrees: f64, turns: bool) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Adding 0 takes the sign from -0, so that equal axes have equal bits.
        let axis = [cos * x + sin * z, y, cos * z - sin * x].map(|number| (number as f32 + 0.0).to_bits());
        Self { axis, turns, in_world: false }
    }

    /// The direction in the world that S.w is the cosine with, before `environment_rotation`.
    #[must_use]
    pub fn axis(&self) -> [f32; 3] {
        self.axis.map(f32::from_bits)
    }

    /// That direction, turned about +Y by `degrees` more.
    #[must_use]
    pub fn turned(&self, degrees: f64) -> [f32; 3] {
        if self.in_world {
            return self.axis();
        }
        Self::new(self.axis().map(f64::from), degrees, false).axis()
    }

    /// Whether it stands in the world, whatever turns the environment.
    #[must_use]
    pub const fn is_in_world(&self) -> bool {
        self.in_world
    }

    /// Whether `environment_rotation` is free: then samples hold a normal in the place of S.w.
    #[must_use]
    pub const fn turns(&self) -> bool {
        self.turns
    }

    /// This axis, turning or not; what stands in the world does not.
    #[must_use]
    pub const fn turning(self, turns: bool) -> Self {
        Self { turns: turns && !self.in_world, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_turns_with_the_environment_by_the_right_hand_rule() {
        let [x, y, z] = Dapple::new([0.0, 0.0, 1.0], 90.0, false).axis();
        // Ry(90 degrees) takes +Z to +X; a rounding of f64 at 0.
        assert_eq!((x, y), (1.0, 0.0));
        assert!(z.abs() < 1e-16, "{z}");
        let ahead = Dapple::new([0.0, 0.0, 1.0], 0.0, false);
        assert_eq!(ahead.turned(90.0), [x, y, z]);
        assert_eq!(Dapple::new([-0.0, 0.0, 1.0], 0.0, false), ahead);
    }

    #[test]
    fn what_no_scene_asks_for_stands_in_the_world() {
        let held = Dapple::default();
        assert_eq!(held.turned(90.0), [0.0, 0.0, 1.0]);
        assert!(
            !held.turning(true).turns() && Dapple::new([0.0, 0.0, 1.0], 0.0, false).turning(true).turns()
        );
    }
}
