//! What the model reads of a point of the surface: interpolated frames, silhouette, maps.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::footprint::{Footprint, Footprints, filtered};
use super::posed::PosedSurface;
use super::rows::Row;
use super::supply::{Points, put_each};
use super::surface_records::{Asked, Unmade};
use super::trace::Hit;
use crate::model::effects::{Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::fields::Field;
use crate::model::fragment::{Fragment, decode_normal, guarded, normal_spread, unit_view};
use crate::model::params::Param;
use crate::model::vector::normalize_or;
use crate::scene::Scene;
use crate::scene::maps::{Map, Maps};
use crate::scene::mesh::PosedMesh;
use crate::scene::view::Camera;

/// The field of how far normals below a sample are apart.
pub(super) const NORMAL_SPREAD: &str = "normal_spread";

/// Whether the shading normal has a part along T and B. Of a missing map, the listing still reads its neutral
/// value, which it does not decode.
fn bumped(scene: &Scene) -> bool {
    let normal_map = scene.needs().normal_map;
    normal_map && (scene.maps.normal.is_some() || scene.form == Form::Listing)
}

/// What the effects of a scene read of each sample.
pub(super) fn asked_of(scene: &Scene) -> Asked {
    let bumped = bumped(scene) && !scene.mesh.tangents.is_empty();
    asked(&scene.setup(), bumped)
}

fn asked(setup: &Setup, bumped: bool) -> Asked {
    let needs = setup.needs();
    Asked {
        bump: bumped,
        normal: needs.smooth_normal,
        albedo: needs.color_map,
        occlusion: needs.occlusion,
        silhouette: needs.rim && setup.silhouette != Silhouette::Bumped && !setup.rim_of_corners(),
        corners: needs.rim && setup.rim_of_corners(),
        dapple: needs.dapple && !setup.dapple.turns(),
        dapple_normal: needs.dapple && setup.dapple.turns(),
        specular: needs.specular_map,
        attenuator: needs.attenuator_map,
        uv: needs.atlas,
        fields: needs.fields,
        weight: true,
    }
}

/// The vertex stage of one view, ready to be read at any point.
pub(super) struct Surface<'a> {
    posed: &'a PosedSurface<'a>,
    mesh: &'a PosedMesh,
    maps: &'a Maps,
    occlusion: Option<&'a [f32]>,
    form: Form,
    setup: Setup,
    /// What S.w is the cosine with.
    dapple: Vec3,
    eye: DVec3,
    /// w cross(N, T) of each vertex; empty without a normal map.
    bitangents: Vec<Vec3>,
    /// Unit vectors from the eye to each vertex; empty where no one asks.
    views: Vec<Vec3>,
    /// How much of the maps samples cover, where these are filtered over it.
    footprints: Option<Footprints<'a>>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(scene: &'a Scene, posed: &'a PosedSurface<'a>, camera: &Camera) -> Self {
        let eye = camera.eye();
        let (mesh, occlusion) = (posed.mesh, posed.open.as_deref());
        let setup = scene.setup();
        let dapple = setup.dapple.turned(scene.params.scalar(Param::EnvironmentRotation)).into();
        let bumped = bumped(scene) && !mesh.tangents.is_empty();
        let bitangent = |(n, t): (&Vec3, &glam::Vec4)| t.w * n.cross(t.truncate()).normalize_or_zero();
        let bitangents = if bumped {
            mesh.normals.par_iter().zip(&mesh.tangents).map(bitangent).collect()
        } else {
            Vec::new()
        };
        let per_vertex = scene.form == Form::Listing || scene.silhouette == Silhouette::Vertex;
        let view = |p: &Vec3| (p.as_dvec3() - eye).normalize_or_zero().as_vec3();
        let views = if per_vertex { mesh.positions.par_iter().map(view).collect() } else { Vec::new() };
        let (form, maps) = (scene.form, &scene.maps);
        let axis = scene.quality.samples_per_axis.max(1);
        let footprints = posed.mip_maps.is_some().then(|| Footprints::new(mesh, camera, axis));
        Self { posed, mesh, maps, occlusion, form, setup, dapple, eye, bitangents, views, footprints }
    }

    /// What the effects read of each sample.
    pub(super) fn asked(&self) -> Asked {
        asked(&self.setup, !self.bitangents.is_empty())
    }

    /// The surface at `hit`.
    pub(super) fn at(&self, hit: Hit) -> (Fragment<f32>, Unmade) {
        let corners = self.corners(hit);
        let weights = hit.weights();
        let vector = |of: &[Vec3]| -> Vec3 { (0..3).map(|i| weights[i] * of[corners[i]]).sum() };
        let scalar = |of: &[f32]| -> f32 { (0..3).map(|i| weights[i] * of[corners[i]]).sum() };

        let exact_view = self.exact_view(corners, hit.barycentric);
        let view = match self.form {
            Form::Corrected => exact_view,
            Form::Listing => vector(&self.views),
        };
        let interpolated = vector(&self.mesh.normals);
        let (normal, _) = normalize_or(interpolated.to_array(), (-exact_view).to_array());
        let normal = Vec3::from(normal);
        let uv = hit.uv(self.mesh);
        let footprint = self.footprints.as_ref().map(|footprints| footprints.at(hit));
        let at = (uv, footprint);
        let (base, bump) = if self.bitangents.is_empty() {
            (if self.form == Form::Listing { interpolated } else { normal }, Vec3::ZERO)
        } else {
            let tangent = (0..3).map(|i| weights[i] * self.mesh.tangents[corners[i]].truncate()).sum();
            self.bumped(at, interpolated, tangent, vector(&self.bitangents))
        };
        let corner_silhouettes = self.corner_silhouettes(corners);
        let silhouette = match self.setup.silhouette {
            Silhouette::Vertex => (0..3).map(|i| weights[i] * corner_silhouettes[i]).sum(),
            Silhouette::Fragment | Silhouette::Bumped => 1.0 - normal.dot(view).abs().min(1.0),
        };
        let (base, bump) = guarded(base.to_array(), bump.to_array(), exact_view.to_array());
        let dapple = self.dapple.dot(interpolated);
        let fragment = Fragment {
            base,
            bump,
            view: view.to_array(),
            normal: normal.to_array(),
            occlusion: self.occlusion.map_or(1.0, scalar),
            silhouette,
            dapple: match self.form {
                Form::Corrected => dapple.max(0.0),
                Form::Listing => dapple,
            },
            albedo: self.map(|maps| maps.color.as_ref(), [1.0; 3], at),
            specular: self.map(|maps| maps.specular.as_ref(), [1.0], at)[0],
            attenuator: self.map(|maps| maps.attenuator.as_ref(), [1.0], at)[0],
        };
        let dapple_normal = interpolated.to_array();
        let chart = self.posed.charts.get(corners[0]).map_or(1.0, |&chart| chart as f32);
        let uv = if self.mesh.own_atlas_uvs.is_empty() { uv } else { hit.atlas_uv(self.mesh) };
        (
            fragment,
            Unmade { dapple_normal, corner_silhouettes, corner_shares: weights, uv: uv.to_array(), chart },
        )
    }

    fn corners(&self, hit: Hit) -> [usize; 3] {
        self.mesh.triangles[hit.triangle as usize].map(|i| i as usize)
    }

    /// A field's numbers at each of the points, a row each.
    pub(super) fn field(&self, field: Field, points: &Points, rows: &mut [Row]) {
        if field.map().is_some() {
            return put_each(points, rows, |hit, numbers| {
                let at = (hit.uv(self.mesh), self.footprints.as_ref().map(|footprints| footprints.at(hit)));
                let neutral = field.info().neutral;
                match numbers {
                    [number] => [*number] = self.map(|maps| maps.scalar(field), [neutral], at),
                    numbers => {
                        let color = self.map(|maps| maps.colored(field), [neutral; 3], at);
                        numbers.copy_from_slice(&color);
                    }
                }
            });
        }
        if field.name() == NORMAL_SPREAD {
            return put_each(points, rows, |hit, numbers| numbers.fill(self.normal_spread(hit)));
        }
        match self.posed.lobes.as_ref().filter(|lobes| lobes.finds(field)) {
            Some(lobes) => put_each(points, rows, |hit, numbers| {
                lobes.find(field, (hit.triangle, hit.weights()), &self.at(hit).0, numbers);
            }),
            None => self.posed.field_of_each(field, points, rows),
        }
    }

    /// S.z at three vertices; 0 where no one asks.
    fn corner_silhouettes(&self, corners: [usize; 3]) -> [f32; 3] {
        let view = |i: usize| self.views.get(i).copied();
        let silhouette = |view: Vec3, i: usize| 1.0 - self.mesh.normals[i].dot(view).abs().min(1.0);
        corners.map(|i| view(i).map_or(0.0, |view| silhouette(view, i)))
    }

    /// A map at texture coordinates, over what a sample covers there; `neutral` where the scene has none.
    fn map<const C: usize>(
        &self,
        pick: impl Fn(&Maps) -> Option<&Map<C>>,
        neutral: [f32; C],
        (uv, footprint): (Vec2, Option<Footprint>),
    ) -> [f32; C] {
        let Some(map) = pick(self.maps) else { return neutral };
        match (&self.posed.mip_maps, footprint) {
            (Some(mip_maps), Some(footprint)) => filtered(map, mip_maps, pick, uv, &footprint),
            _ => map.sample(uv.x, uv.y),
        }
    }

    /// The normal map's part along N, and its part along T and B.
    fn bumped(&self, at: (Vec2, Option<Footprint>), n: Vec3, t: Vec3, b: Vec3) -> (Vec3, Vec3) {
        let texel = self.map(|maps| maps.normal.as_ref(), [0.5, 0.5, 1.0], at);
        let [t, b, n] = [t, b, n].map(|v| v.to_array());
        let (base, bump) = decode_normal(self.form, texel, t, b, n);
        (base.into(), bump.into())
    }

    /// How far the normal map's directions below a sample are apart; 0 where it is not read.
    fn normal_spread(&self, hit: Hit) -> f32 {
        if self.bitangents.is_empty() || self.maps.normal.is_none() {
            return 0.0;
        }
        let at = (hit.uv(self.mesh), self.footprints.as_ref().map(|footprints| footprints.at(hit)));
        normal_spread(self.map(|maps| maps.normal.as_ref(), [0.5, 0.5, 1.0], at))
    }

    /// The unit vector from the eye to the point.
    fn exact_view(&self, corners: [usize; 3], [u, v]: [f32; 2]) -> Vec3 {
        let [a, b, c] = corners.map(|i| self.mesh.positions[i].as_dvec3());
        let point = a + f64::from(u) * (b - a) + f64::from(v) * (c - a);
        DVec3::from(unit_view((point - self.eye).to_array())).as_vec3()
    }
}
