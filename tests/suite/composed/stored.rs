//! The file's fragments as stored samples, and its atlas as stored texels.

use std::ops::Range;
use std::sync::Arc;

use skinfit::bake::{Illumination, LobeStack};
use skinfit::engine::view::ObservedView;
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::Fragment;
use skinfit::samples::rows::{Row, Rows};
use skinfit::samples::surface_records::{Asked, Unmade};
use skinfit::samples::{Atlas, LANES, SurfaceRecords, ViewSamples};
use skinfit::shader::Facts;
use skinfit::shader::facts::FaceSizes;
use skinfit_core::program::graph::Input;
use skinfit_core::program::levels::texel_inputs;

use super::file::Composed;

/// What the fragments' rules are planned for.
pub(super) fn facts(setup: Setup) -> Facts {
    let size = Some(4);
    let faces = FaceSizes { irradiance: size, specular: size, hilite: size, reflected: size };
    Facts::of_samples(setup, faces, true)
}

impl Composed<'_> {
    /// The file's cubes in f32; no E_r.
    pub(super) fn illumination(&self) -> Illumination {
        let [irradiance, specular, hilite] =
            self.cubes.each_ref().map(|cube| cube.map(|texel| texel.map(|x| x as f32)));
        Illumination {
            irradiance: Some(irradiance),
            lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![specular] }),
            hilite: Some(hilite),
            reflected: None,
        }
    }

    /// Texels along a side of the square that holds the file's atlas, and the share of it that the atlas is high.
    fn square(&self) -> (usize, f64) {
        let [width, height] = ["width", "height"].map(|name| self.inputs("atlas").at(name).number());
        assert!(width >= height);
        (width as usize, height / width)
    }

    /// The atlas, with what rules of texels read.
    pub(super) fn atlas(&self, setup: Setup) -> Arc<Atlas> {
        let (size, _) = self.square();
        let atlas = self.inputs("atlas");
        let mut charts = vec![0; size * size];
        let mut steps = vec![[0.0; 2]; size * size];
        for (row, (own, stretch)) in
            atlas.at("chart").items().iter().zip(atlas.at("stretch").items()).enumerate()
        {
            for (column, (chart, stretch)) in own.numbers().into_iter().zip(stretch.items()).enumerate() {
                charts[row * size + column] = chart as u32;
                steps[row * size + column] = [0, 1].map(|axis| stretch.item(axis).number());
            }
        }
        // Texels stand in the file as they are covered, row by row.
        let covered: Vec<usize> = (0..size * size).filter(|&texel| charts[texel] > 0).collect();
        let value = |input: &Input, texel: usize| {
            let i = covered.binary_search(&texel).unwrap();
            self.texel(i, steps[texel], input) as f32
        };
        let inputs = texel_inputs(&facts(setup)).unwrap();
        Arc::new(Atlas::of_charts(size as u32, &charts, inputs, value))
    }

    /// The fragments, a pixel each of one record; beyond the last it is repeated.
    pub(super) fn samples(&self, setup: Setup) -> ViewSamples {
        let needs = setup.needs();
        let atlas = needs.atlas.then(|| self.atlas(setup));
        let asked = Asked { uv: needs.atlas, fields: needs.fields, ..Asked::EVERYTHING };
        let mut surface = SurfaceRecords::new(asked, 1);
        let lane = |slot: usize| slot.min(self.count() - 1);
        for slot in 0..LANES {
            let share = if slot < self.count() { 1.0 } else { 0.0 };
            surface.set_all(slot, &(self.fragment(lane(slot)), self.place(lane(slot))), share);
        }
        let places: Vec<_> = surface.places().fields().map(|(name, at, _)| (name, at)).collect();
        for field in needs.fields.iter() {
            let Some((_, at)) = places.iter().find(|(name, _)| *name == field.name()) else { continue };
            for component in 0..field.info().numbers {
                let input = Input { name: field.name().to_owned(), component };
                for (slot, number) in surface.rows_mut().plane_mut(at + component).enumerate() {
                    *number = self.field(lane(slot), &input) as f32;
                }
            }
        }
        ViewSamples {
            group_start: vec![0, 1],
            pixel: (0..LANES as u32).collect(),
            coverage: vec![1.0; LANES],
            surface,
            atlas,
            ..ViewSamples::default()
        }
    }

    fn fragment(&self, i: usize) -> Fragment<f32> {
        let number =
            |name: &str, component| self.field(i, &Input { name: name.to_owned(), component }) as f32;
        let three = |name: &str| [0, 1, 2].map(|component| number(name, component));
        Fragment {
            base: three("base"),
            bump: three("bump"),
            normal: three("normal"),
            view: three("view"),
            occlusion: number("open", 0),
            silhouette: number("silhouette", 0),
            dapple: number("dapple", 0),
            albedo: three("albedo"),
            specular: number("specular", 0),
            attenuator: number("attenuator", 0),
        }
    }

    /// Where a fragment lies in the square.
    fn place(&self, i: usize) -> Unmade {
        let at = self.inputs("fragments");
        let [u, v] = [0, 1].map(|axis| at.at("uv").item(i).item(axis).number());
        let chart = at.at("chart").item(i).number() as f32;
        Unmade { uv: [u as f32, (v * self.square().1) as f32], chart, ..Unmade::default() }
    }
}

/// Samples as engines see them: every fragment with its target, all four channels compared, `counted` of them alone.
pub(super) fn observed(samples: &ViewSamples, targets: &[[f64; 4]], counted: Range<usize>) -> ObservedView {
    let (mut target, mut weight) = (Rows::new(4, 1), vec![Row::ZERO]);
    for (slot, wanted) in targets.iter().enumerate() {
        (0..4).for_each(|c| target.record_mut(0)[c][slot] = wanted[c] as f32);
        weight[0][slot] = f32::from(u8::from(counted.contains(&slot)));
    }
    ObservedView { samples: samples.clone(), target, weight, clip: None }
}
