//! Single bakes, each through the cache.

use std::path::Path;
use web_time::Instant;

use super::cache::{self, Found, Key};
use super::cutouts::Cutouts;
use super::harmonics::Order;
use super::interreflection::Albedo;
use super::panorama::Radiance;
use super::prefilter::Prefilter;
use super::radial::Radial;
use super::thickness::{VertexThickness, bake_thickness};
use super::transfer::{TransferSet, VertexTransfer, bake_transfer};
use super::{BakeStats, VertexOcclusion, occlusion};
use crate::model::cube::Cube;
use crate::progress;
use crate::scene::maps::{Environment, luminance};
use crate::scene::mesh::PosedMesh;
use crate::specular::SpecularModel;

/// Bakes through the cache, and keeps count.
pub(super) struct Baker<'a> {
    pub(super) cache: Option<&'a Path>,
    pub(super) stats: BakeStats,
}

impl Baker<'_> {
    /// `count` numbers from the cache, or from `make`, which then go to the cache.
    fn through_cache(
        &mut self,
        name: String,
        kind: &str,
        key: &Key,
        count: usize,
        make: impl FnOnce(&mut BakeStats) -> Vec<f32>,
    ) -> Vec<f32> {
        let since = Instant::now();
        match self.cache.map(|folder| cache::read(folder, kind, key, count)) {
            Some(Found::Floats(floats)) => {
                self.stats.row(name, true, since.elapsed().as_secs_f64());
                return floats;
            }
            Some(Found::Unusable(warning)) => self.stats.warnings.push(warning),
            Some(Found::Nothing) | None => {}
        }
        let before = self.stats.seconds();
        let floats = make(&mut self.stats);
        // What was shared has a row of its own.
        let shared = self.stats.seconds() - before;
        if let Some(folder) = self.cache
            && let Err(warning) = cache::write(folder, kind, key, &floats)
            // Once is enough for a folder that cannot be written.
            && !self.stats.warnings.iter().any(|w| w.contains("not kept"))
        {
            self.stats.warnings.push(warning);
        }
        self.stats.row(name, false, since.elapsed().as_secs_f64() - shared);
        floats
    }

    /// Ambient occlusion, with a set for each of `morphs` targets.
    pub(super) fn occlusion(
        &mut self,
        pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
        morphs: usize,
        rays: u32,
    ) -> VertexOcclusion {
        let (key, vertices) = posed_key(Key::new("occlusion").with(&[rays]), pose, morphs);
        let count = (1 + morphs) * vertices;
        let floats = self.through_cache("occlusion".to_owned(), "occlusion", &key, count, |_| {
            let baked = occlusion::bake_occlusion(pose, morphs, rays);
            std::iter::once(baked.base).chain(baked.morphs).flatten().collect()
        });
        let mut sets = floats.chunks_exact(vertices.max(1)).map(<[f32]>::to_vec);
        VertexOcclusion { base: sets.next().unwrap_or_default(), morphs: sets.collect() }
    }

    /// Thickness, with a set for each of `morphs` targets.
    pub(super) fn thickness(
        &mut self,
        pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
        morphs: usize,
    ) -> VertexThickness {
        let (key, vertices) = posed_key(Key::new("thickness"), pose, morphs);
        let count = (1 + morphs) * vertices;
        let floats = self.through_cache("thickness".to_owned(), "thickness", &key, count, |_| {
            let baked = bake_thickness(pose, morphs);
            std::iter::once(baked.base).chain(baked.morphs).flatten().collect()
        });
        let mut sets = floats.chunks_exact(vertices.max(1)).map(<[f32]>::to_vec);
        VertexThickness { base: sets.next().unwrap_or_default(), morphs: sets.collect() }
    }

    /// Transfer vectors, with a set for each of `morphs` targets; with an `albedo` those of bounces too.
    pub(super) fn transfer(
        &mut self,
        pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
        morphs: usize,
        rays: u32,
        order: Order,
        albedo: Option<&Albedo<'_>>,
    ) -> VertexTransfer {
        let key = Key::new("transfer").with(&[rays, order.bands() as u32, u32::from(albedo.is_some())]);
        let (mut key, vertices) = posed_key(key, pose, morphs);
        if let Some(albedo) = albedo {
            key = albedo.key(key, &pose(&[]));
        }
        // A vertex' numbers: T, and T' for three channels.
        let (direct, bounced) = (order.functions(), if albedo.is_some() { 3 * order.functions() } else { 0 });
        let count = (1 + morphs) * vertices * (direct + bounced);
        let floats = self.through_cache("transfer".to_owned(), "transfer", &key, count, |_| {
            let baked = bake_transfer(pose, morphs, rays, order, albedo);
            let sets = std::iter::once(baked.base).chain(baked.morphs);
            sets.flat_map(|set| [set.direct, set.bounced.into_flattened()]).flatten().collect()
        });
        let size = (vertices * (direct + bounced)).max(1);
        let mut sets = floats.chunks_exact(size).map(|set| {
            let (direct, bounced) = set.split_at(vertices * direct);
            TransferSet { direct: direct.to_vec(), bounced: bounced.as_chunks().0.to_vec() }
        });
        VertexTransfer { order, base: sets.next().unwrap_or_default(), morphs: sets.collect() }
    }
}

/// A key with the mesh at rest and with each of `morphs` targets at weight 1, and how many vertices it has; and with what
/// its rays are drawn by.
pub(super) fn posed_key(
    mut key: Key,
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    morphs: usize,
) -> (Key, usize) {
    let mut vertices = 0;
    for target in 0..=morphs {
        let weights: Vec<f32> = (1..=morphs).map(|i| f32::from(u8::from(i == target))).collect();
        let posed = pose(&weights);
        key = key.with(&posed.positions).with(&posed.normals).with(posed.triangles.as_flattened());
        vertices = posed.positions.len();
        if let Some(rest) = posed.rest.as_deref().filter(|_| target == 0) {
            key = key.with(&rest.positions).with(&rest.normals);
        }
        // Those of all poses are the same.
        if target == 0 {
            key = Cutouts::of(&posed).into_iter().fold(key, |key, cutouts| cutouts.key(key));
        }
    }
    (key, vertices)
}

/// Bakes of one environment; what they share is made when the first asks for it.
pub(super) struct EnvironmentBaker<'a> {
    environment: &'a Environment,
    key: Key,
    prefilter: Option<Prefilter>,
}

impl<'a> EnvironmentBaker<'a> {
    pub(super) fn new(environment: &'a Environment) -> Self {
        let map = &environment.panorama;
        let key = Key::new("environment")
            .with(&[map.width as u64, map.height as u64])
            .with(map.texels.as_flattened())
            .with(&[environment.rotation_degrees, environment.intensity]);
        Self { environment, key, prefilter: None }
    }

    /// The environment through a Phong lobe; exponent 1 is the irradiance.
    pub(super) fn lobe(
        &mut self,
        baker: &mut Baker<'_>,
        name: String,
        size: usize,
        exponent: f64,
    ) -> Cube<f32> {
        let key = self.key.clone().with(&[size as u64]).with(&[exponent]);
        self.radial(baker, name, &key, size, Radial::Phong(exponent))
    }

    /// The environment through a BRDF's lobe, for a roughness.
    pub(super) fn reflected(
        &mut self,
        baker: &mut Baker<'_>,
        model: SpecularModel,
        size: usize,
        m: f64,
    ) -> Cube<f32> {
        let key = self.key.clone().with(model.name().as_bytes()).with(&[size as u64]).with(&[m]);
        let name = format!("{} {m:.4}", model.name());
        self.radial(baker, name, &key, size, Radial::Brdf(model, m))
    }

    fn radial(
        &mut self,
        baker: &mut Baker<'_>,
        name: String,
        key: &Key,
        size: usize,
        radial: Radial,
    ) -> Cube<f32> {
        let (kind, message) = match radial {
            Radial::Phong(exponent) => ("lobe", format!("exponent {exponent:.4}")),
            Radial::Brdf(_, m) => ("reflected", format!("roughness {m:.4}")),
        };
        let floats = baker.through_cache(name, kind, key, 24 * size * size, |stats| {
            let prefilter = self.prefilter(stats);
            let bar = progress::bar("prefilter", (6 * size * size) as u64);
            bar.set_message(message);
            let cube = prefilter.radial(size, radial, |n| bar.inc(n));
            bar.finish_and_clear();
            cube_to_floats(&cube)
        });
        cube_from_floats(size, &floats)
    }

    /// The environment's mean over each texel.
    pub(super) fn hilite(&mut self, baker: &mut Baker<'_>, size: usize) -> Cube<f32> {
        // Version 2: cubes of more than 512 texels a side keep a fine panorama's detail.
        let key = self.key.clone().with(&[2, size as u64]);
        let floats = baker.through_cache("hilite".to_owned(), "hilite", &key, 24 * size * size, |stats| {
            let shared = self.prefilter(stats).means(size);
            let cube = shared.unwrap_or_else(|| Radiance::for_cube(self.environment, size).to_cube(size));
            cube_to_floats(&cube.map(|texel| {
                let [r, g, b, _] = texel.map(|x| x as f32);
                [r, g, b, luminance([r, g, b])]
            }))
        });
        cube_from_floats(size, &floats)
    }

    /// The environment, ready to be filtered.
    fn prefilter(&mut self, stats: &mut BakeStats) -> &Prefilter {
        self.prefilter.get_or_insert_with(|| {
            let since = Instant::now();
            let prefilter = Prefilter::of(&Radiance::new(self.environment));
            stats.row("environment", false, since.elapsed().as_secs_f64());
            prefilter
        })
    }
}

fn cube_to_floats(cube: &Cube<f32>) -> Vec<f32> {
    let size = cube.size();
    let texel = |i: usize| cube.texel(i / (size * size), i % size, i / size % size);
    (0..6 * size * size).flat_map(texel).collect()
}

fn cube_from_floats(size: usize, floats: &[f32]) -> Cube<f32> {
    let (texels, _) = floats.as_chunks::<4>();
    Cube::from_fn(size, |face, column, row| texels[(face * size + row) * size + column])
}
