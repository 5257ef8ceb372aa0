//! A scene's mesh in one pose with all that its samples and texels are made of.

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;

use super::lobe::Lobes;
use super::lobe_light::LobeLight;
use super::rows::Row;
use super::skin::Skin;
use super::sky::Sky;
use super::supply::{Points, Supplies, put_each};
use super::surface::NORMAL_SPREAD;
use super::trace::Hit;
use super::{SampleError, bounced, far_light, lit, posed_occlusion, sky, through};
use crate::bake::interreflection::VertexGather;
use crate::bake::inward::InwardRays;
use crate::bake::lobe_sky::LobeSky;
use crate::bake::rays::RayMesh;
use crate::bake::sky::{SKIN_SEEN, sees_skin, traces_lobes};
use crate::bake::{Bake, SkyBake, VertexOcclusion, VertexThickness};
use crate::model::fields::{Field, FieldInfo, Fields};
use crate::scene::Scene;
use crate::scene::charts::charts;
use crate::scene::mesh::{Mesh, Morph, PosedMesh};
use crate::scene::mip_maps::MipMaps;

/// What is baked of a scene's surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfaceBakes<'a> {
    /// Ambient occlusion, when asked for.
    pub occlusion: Option<&'a VertexOcclusion>,
    /// The sky that each vertex sees, when asked for.
    pub sky: Option<&'a SkyBake>,
    /// How thick the mesh is below each vertex, where it is known already.
    pub thickness: Option<&'a VertexThickness>,
    /// What its vertices gather of one another ([`super::gather_of`]), where it is known already.
    pub gather: Option<&'a VertexGather>,
    /// Where rays inward from its vertices leave it, where it is known already.
    pub inward: Option<&'a InwardRays>,
    /// The folder of the bakes that are kept: of what vertices gather, too.
    pub cache: Option<&'a Path>,
    /// The environment as specular lobes see it by rays, where it is known already.
    pub lobe_sky: Option<&'a Arc<LobeSky>>,
    /// The coarser levels of the scene's maps, where they are known already.
    pub mip_maps: Option<&'a Arc<MipMaps>>,
}

impl<'a> From<&'a Bake> for SurfaceBakes<'a> {
    fn from(bake: &'a Bake) -> Self {
        let (occlusion, sky, thickness) =
            (bake.occlusion.as_ref(), bake.sky.as_ref(), bake.thickness.as_ref());
        Self { occlusion, sky, thickness, ..Self::default() }
    }
}

/// A mesh in one pose, with its vertices' numbers and what finds others at any of its points.
pub struct PosedSurface<'a> {
    pub(super) mesh: &'a PosedMesh,
    pub(super) rays: &'a RayMesh,
    /// Open share of each vertex' hemisphere.
    pub(super) open: Option<Vec<f32>>,
    /// The coarser levels of the scene's maps, where its filter reads them.
    pub(super) mip_maps: Option<Arc<MipMaps>>,
    /// The chart of the UV atlas that each vertex is of, where effects are computed there.
    pub(super) charts: Vec<u32>,
    supplies: Supplies<'a>,
    /// What rays into specular lobes find, where such rays are traced.
    pub(super) lobes: Option<Lobes<'a>>,
}

/// Each vertex as a point of a triangle; none of one that is of no triangle.
pub(super) fn hits_of_vertices(mesh: &PosedMesh) -> Vec<Option<Hit>> {
    let mut hits = vec![None; mesh.positions.len()];
    for (triangle, corners) in (0..).zip(&mesh.triangles) {
        for (corner, barycentric) in corners.iter().zip([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) {
            hits[*corner as usize] = Some(Hit { triangle, barycentric });
        }
    }
    hits
}

impl<'a> PosedSurface<'a> {
    /// The mesh of `scene` as it is posed; `rays` holds its triangles, and `morphs` are the targets at their weights.
    ///
    /// # Errors
    /// When something was baked for another mesh.
    pub fn new(
        scene: &'a Scene,
        mesh: &'a PosedMesh,
        rays: &'a RayMesh,
        morphs: &[Morph],
        bakes: SurfaceBakes<'a>,
    ) -> Result<Self, SampleError> {
        let open = posed_occlusion(scene, morphs, mesh.positions.len(), bakes.occlusion)?;
        let made = || MipMaps::new(&scene.maps, scene.quality.texture_filter).map(Arc::new);
        let mip_maps = bakes.mip_maps.cloned().or_else(made);
        let needs = scene.needs();
        let Mesh { positions, .. } = &scene.mesh;
        let of_skin = || charts(positions, scene.mesh.atlas_uvs(), &mesh.skin_triangles());
        let charts = if needs.atlas { of_skin() } else { Vec::new() };
        let fields = needs.fields;
        Ok(Self { open, mip_maps, charts, ..Self::with_fields(scene, mesh, rays, morphs, bakes, fields)? })
    }

    /// The mesh of `scene` as it is posed with what finds `fields` at its points, and no open shares.
    ///
    /// # Errors
    /// When the sky or the thickness was baked for another mesh.
    pub fn with_fields(
        scene: &'a Scene,
        mesh: &'a PosedMesh,
        rays: &'a RayMesh,
        morphs: &[Morph],
        bakes: SurfaceBakes<'a>,
        fields: Fields,
    ) -> Result<Self, SampleError> {
        let mut supplies = lit::supplies(scene, mesh, rays);
        let make = || bounced::gather_for(scene, mesh, fields, bakes.cache);
        let own = if bakes.gather.is_none() { make() } else { None };
        let gather = bakes.gather.or(own.as_ref());
        supplies.extend(bounced::supplies(scene, mesh, rays, gather, fields));
        supplies.extend(through::supplies(scene, mesh, rays, morphs, (bakes.thickness, fields))?);
        let mut lit = None;
        let sky = bakes.sky.map(|bake| Sky::new(scene, mesh, morphs, bake)).transpose()?;
        supplies.extend(far_light::supplies(scene, (mesh, rays), sky.as_ref(), bakes.inward, fields));
        if let Some((sky, bake)) = sky.zip(bakes.sky) {
            supplies.extend(sky::supplies(scene, rays, &sky, (bake, gather), fields));
            let gather = gather.filter(|_| sees_skin(scene, fields));
            let skin = gather.map(|gather| Skin::new(scene, mesh, rays, &sky, gather));
            let seen = fields.named(SKIN_SEEN).zip(skin.as_ref());
            supplies.extend(seen.map(|(field, skin)| (field, skin.seen())));
            lit = skin.filter(|_| traces_lobes(scene, fields) && scene.reflects_skin()).map(|s| s.lit());
        }
        let sky = || bakes.lobe_sky.cloned().or_else(|| LobeSky::of_scene(scene).map(Arc::new));
        let light = LobeLight::new(scene, fields, sky, lit);
        let lobes = Lobes::new(scene, mesh, rays, light, fields);
        Ok(Self { supplies, lobes, ..Self::bare(mesh, rays, None) })
    }

    /// A mesh with the open share of each vertex' hemisphere, and nothing else.
    #[must_use]
    pub const fn bare(mesh: &'a PosedMesh, rays: &'a RayMesh, open: Option<Vec<f32>>) -> Self {
        Self { mesh, rays, open, mip_maps: None, charts: Vec::new(), supplies: Vec::new(), lobes: None }
    }

    /// The same, each vertex being of a chart of the UV atlas.
    #[must_use]
    pub fn in_charts(self, charts: Vec<u32>) -> Self {
        Self { charts, ..self }
    }

    /// Whether a field is found at vertices: what rays into the lobes of samples find is not, nor what is below a sample.
    #[must_use]
    pub fn finds_at_vertices(&self, field: Field) -> bool {
        field.name() != NORMAL_SPREAD && self.lobes.as_ref().is_none_or(|lobes| !lobes.finds(field))
    }

    /// A field's numbers at each vertex, one vertex after the other; a vertex that is of no triangle has what stands in
    /// for them. All cores.
    #[must_use]
    pub fn field_of_vertices(&self, field: Field) -> Vec<f32> {
        let FieldInfo { numbers: count, neutral, .. } = *field.info();
        let hits = hits_of_vertices(self.mesh);
        let mut numbers = vec![neutral; count * hits.len()];
        let found = numbers.par_chunks_mut(count).zip(&hits);
        found.for_each(|(numbers, hit)| {
            if let Some(hit) = hit {
                self.field(field, *hit, numbers);
            }
        });
        numbers
    }

    /// A field's numbers at each of the points, a row each.
    pub(super) fn field_of_each(&self, field: Field, points: &Points, rows: &mut [Row]) {
        match self.supplies.iter().find(|(of, _)| *of == field) {
            Some((_, supply)) => supply.find_each(points, rows),
            None => put_each(points, rows, |hit, numbers| self.field(field, hit, numbers)),
        }
    }

    /// A field's numbers at a point; what stands in for them where nothing has the field.
    pub(super) fn field(&self, field: Field, hit: Hit, numbers: &mut [f32]) {
        if let Some((_, supply)) = self.supplies.iter().find(|(of, _)| *of == field) {
            return supply.find(hit, numbers);
        }
        let Some(of) = self.mesh.fields.iter().find(|of| of.field == field) else {
            return numbers.fill(field.info().neutral);
        };
        let corners = self.mesh.triangles[hit.triangle as usize].map(|corner| of.of(corner as usize));
        let weights = hit.weights();
        for (k, number) in numbers.iter_mut().enumerate() {
            *number = (0..3).map(|i| weights[i] * corners[i][k]).sum();
        }
    }
}
