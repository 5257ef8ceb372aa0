//! Which colours a file's numbers are shares of: primaries and white, and their conversion to Rec.709.

use glam::{DMat3, DVec2, DVec3};

/// CIE 1931 xy of red, green and blue, and of what equal shares of them look like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chromaticities {
    pub(super) primaries: [DVec2; 3],
    pub(super) white: DVec2,
}

/// ITU-R BT.709, whose primaries and white sRGB shares.
pub(super) const REC709: Chromaticities = Chromaticities {
    primaries: [DVec2::new(0.64, 0.33), DVec2::new(0.30, 0.60), DVec2::new(0.15, 0.06)],
    white: DVec2::new(0.3127, 0.3290),
};

/// From XYZ to the responses of cones that are scaled one by one: Bradford (Lindbloom, "Chromatic Adaptation").
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

/// Chromaticities that differ by less are written with fewer digits.
const SAME: f64 = 1e-3;

impl Chromaticities {
    /// The matrix from its linear numbers to those of Rec.709: white stays white (adapted by Bradford). `None` where its
    /// numbers are Rec.709's already.
    ///
    /// # Errors
    /// What is wrong with them, where no such matrix is.
    pub(super) fn to_rec709(self) -> Result<Option<DMat3>, &'static str> {
        let near = |a: DVec2, b: DVec2| (a - b).length() < SAME;
        let own = self.primaries.iter().zip(REC709.primaries).all(|(&a, b)| near(a, b));
        if own && near(self.white, REC709.white) {
            return Ok(None);
        }
        let (from, to) = (self.to_xyz()?, REC709.to_xyz()?);
        let cones = |white: DVec2| white_xyz(white).map(|xyz| BRADFORD * xyz);
        let (here, there) = (cones(self.white)?, cones(REC709.white)?);
        let adapt = BRADFORD.inverse() * DMat3::from_diagonal(there / here) * BRADFORD;
        let matrix = to.inverse() * adapt * from;
        if matrix.is_finite() { Ok(Some(matrix)) } else { Err("chromaticities that no colours have") }
    }

    /// How much of the luminance of white is red's, green's and blue's (`computeYw` in OpenEXR's `ImfRgbaYca.cpp`).
    ///
    /// # Errors
    /// What is wrong with them, where green has none, by which it is found from luminance.
    pub(super) fn luminance(self) -> Result<[f64; 3], &'static str> {
        let shares = self.to_xyz()?.row(1);
        if shares.is_finite() && shares.y.abs() > 1e-3 {
            Ok(shares.to_array())
        } else {
            Err("a green without light")
        }
    }

    /// To CIE XYZ, in which equal shares have Y = 1 (SMPTE RP 177-1993).
    fn to_xyz(self) -> Result<DMat3, &'static str> {
        // Not over y, which is 0 where the numbers are XYZ's own.
        let directions = self.primaries.map(|xy| DVec3::new(xy.x, xy.y, 1.0 - xy.x - xy.y));
        let primaries = DMat3::from_cols_array_2d(&directions.map(|direction| direction.to_array()));
        if !primaries.is_finite() || primaries.determinant().abs() < 1e-6 {
            return Err("primaries that lie on a line");
        }
        let shares = primaries.inverse() * white_xyz(self.white)?;
        Ok(primaries * DMat3::from_diagonal(shares))
    }
}

/// XYZ of a white of Y = 1.
fn white_xyz(white: DVec2) -> Result<DVec3, &'static str> {
    let xyz = DVec3::new(white.x, white.y, 1.0 - white.x - white.y) / white.y;
    // Whites of lamps and screens have all three; what has not is no white.
    if xyz.is_finite() && xyz.min_element() > 0.0 { Ok(xyz) } else { Err("a white that is none") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Chromaticities {
        Chromaticities { primaries: primaries.map(DVec2::from), white: DVec2::from(white) }
    }

    fn check(file: Chromaticities, want: [[f64; 3]; 3], tolerance: f64) {
        let matrix = file.to_rec709().unwrap().unwrap();
        for (row, want) in want.into_iter().enumerate() {
            let off = (matrix.row(row) - DVec3::from(want)).abs().max_element();
            assert!(off < tolerance, "row {row}: {} is not {want:?}", matrix.row(row));
        }
        let white = matrix * DVec3::ONE;
        assert!((white - DVec3::ONE).abs().max_element() < 1e-12, "white becomes {white}");
    }

    #[test]
    fn wide_spaces_have_the_published_matrices() {
        // ITU-R BT.2087-0, M2 (2020 to 709), to its four digits.
        check(
            of([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], [0.3127, 0.3290]),
            [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]],
            1e-4,
        );
        // ACES' own ACEScg to linear Rec.709 with Bradford (OpenColorIO's ACES configurations), to their digits.
        check(
            of([[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]], [0.32168, 0.33767]),
            [
                [1.705_05, -0.621_79, -0.083_26],
                [-0.130_26, 1.140_80, -0.010_55],
                [-0.024_00, -0.128_97, 1.152_97],
            ],
            5e-5,
        );
        // ACES2065-1.
        check(
            of([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], [0.32168, 0.33767]),
            [
                [2.521_69, -1.134_13, -0.387_56],
                [-0.276_48, 1.372_72, -0.096_24],
                [-0.015_38, -0.152_98, 1.168_35],
            ],
            5e-5,
        );
    }

    #[test]
    fn xyz_is_a_space_like_others_and_rec709_is_left_alone() {
        // With an equal-energy white the numbers 1, 1, 1 are white.
        check(
            of([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], [1.0 / 3.0, 1.0 / 3.0]),
            // Lindbloom's XYZ (D65) to sRGB behind his Bradford matrix from E to D65.
            [
                [3.146_77, -1.665_92, -0.480_85],
                [-0.995_93, 1.955_61, 0.040_32],
                [0.063_62, -0.214_58, 1.150_96],
            ],
            1e-3,
        );
        assert_eq!(REC709.to_rec709(), Ok(None));
        let rounded = of([[0.6401, 0.3300], [0.3, 0.6], [0.15, 0.0600]], [0.31270, 0.32902]);
        assert_eq!(rounded.to_rec709(), Ok(None));
    }

    #[test]
    fn luminance_has_the_published_shares() {
        // ITU-R BT.709-6, item 3.2, and BT.2020-2, table 4, to their four digits.
        let bt2020 = of([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], [0.3127, 0.3290]);
        for (space, want) in [(REC709, [0.2126, 0.7152, 0.0722]), (bt2020, [0.2627, 0.6780, 0.0593])] {
            let off = DVec3::from(space.luminance().unwrap()) - DVec3::from(want);
            assert!(off.abs().max_element() < 1e-4, "{off} off {want:?}");
        }
        let of_red = of([[0.64, 0.33], [0.3, 0.0], [0.15, 0.06]], [0.3127, 0.3290]);
        assert!(of_red.luminance().is_err());
    }

    #[test]
    fn what_is_no_space_is_told() {
        let line = of([[0.6, 0.3], [0.4, 0.2], [0.2, 0.1]], [0.3127, 0.3290]);
        assert!(line.to_rec709().is_err());
        let dark = of([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]], [0.3, 0.0]);
        assert!(dark.to_rec709().is_err());
        let nan = of([[f64::NAN, 0.33], [0.3, 0.6], [0.15, 0.06]], [0.3127, 0.3290]);
        assert!(nan.to_rec709().is_err());
    }
}
