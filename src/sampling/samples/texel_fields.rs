//! What texels hold: numbers of the mesh's vertices, of maps and of what is found at its points.

use glam::{DVec2, Vec3, Vec4};

use super::footprint::{Footprint, filtered};
use super::texel_cover::{Layout, Triangle};
use super::texel_error::AtlasError;
use super::trace::Hit;
use crate::model::fields;
use crate::program::graph::Input;
use crate::program::lower::{STEP_ALONG_U, STEP_ALONG_V};
use crate::scene::maps::{Map, Maps};
use crate::scene::mesh::PosedMesh;
use crate::scene::mip_maps::MipMaps;

/// A mesh as it lies in an atlas of `size` texels a side.
pub(super) struct Textured<'a> {
    pub(super) posed: &'a PosedMesh,
    pub(super) occlusion: Option<&'a [f32]>,
    pub(super) maps: &'a Maps,
    /// Their coarser levels, where they are filtered over a texel.
    pub(super) mip_maps: Option<&'a MipMaps>,
    /// What finds a field of samples at a point of the mesh.
    pub(super) find: &'a (dyn Fn(fields::Field, Hit, &mut [f32]) + Sync),
    pub(super) layout: Layout<'a>,
}

impl Textured<'_> {
    /// A map where a triangle's vertices count so much, over a texel of the atlas; `neutral` where there is none.
    fn map<const C: usize>(
        &self,
        pick: impl Fn(&Maps) -> Option<&Map<C>>,
        neutral: [f32; C],
        (triangle, weights): (&Triangle, [f64; 3]),
    ) -> [f32; C] {
        let Some(map) = pick(self.maps) else { return neutral };
        let uv = self.of_maps(triangle, weights).as_vec2();
        match self.mip_maps {
            Some(mip_maps) => filtered(map, mip_maps, pick, uv, &self.footprint(triangle)),
            None => map.sample(uv.x, uv.y),
        }
    }

    /// The texture coordinates of the maps, weighed so.
    fn of_maps(&self, triangle: &Triangle, weights: [f64; 3]) -> DVec2 {
        let corner = |i: usize| self.posed.uvs.get(triangle.vertices[i]).copied().unwrap_or_default();
        (0..3).map(|i| weights[i] * corner(i).as_dvec2()).sum()
    }

    /// What a texel of the atlas covers of maps.
    fn footprint(&self, triangle: &Triangle) -> Footprint {
        if self.posed.own_atlas_uvs.is_empty() {
            let step = 1.0 / f64::from(self.layout.size);
            return Footprint::new([step, 0.0], [0.0, step]);
        }
        let [along, down] = triangle.steps().map(|step| self.of_maps(triangle, step).to_array());
        Footprint::new(along, down)
    }
}

/// One number of a texel.
pub(super) struct Field {
    of: Quantity,
    component: usize,
    step: Option<usize>,
}

/// What texels hold ([`crate::shader::emit::TEXEL`]).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Position,
    Normal,
    Tangent,
    Bitangent,
    Uv,
    Occlusion,
    Color,
    Specular,
    Attenuator,
    NormalMap,
    /// What files of rules declare.
    Declared(fields::Field),
    /// Of those, what is found at each texel by itself.
    Found(fields::Field),
    /// Of those, what a map of theirs shows there.
    Mapped(fields::Field),
}

impl Field {
    pub(super) fn of(input: &Input) -> Result<Self, AtlasError> {
        let steps = [STEP_ALONG_U, STEP_ALONG_V];
        let step = steps.iter().position(|prefix| input.name.starts_with(prefix));
        let name = step.map_or(&*input.name, |axis| &input.name[steps[axis].len()..]);
        let of = match name {
            "vertex_position" => Quantity::Position,
            "vertex_normal" => Quantity::Normal,
            "vertex_tangent" => Quantity::Tangent,
            "vertex_bitangent" => Quantity::Bitangent,
            "vertex_uv" => Quantity::Uv,
            "vertex_occlusion" => Quantity::Occlusion,
            "albedo" if step.is_none() => Quantity::Color,
            "specular" if step.is_none() => Quantity::Specular,
            "attenuator" if step.is_none() => Quantity::Attenuator,
            "normal_texel" if step.is_none() => Quantity::NormalMap,
            other => match fields::Field::from_name(other) {
                Some(field) if field.is_of_vertices() => Quantity::Declared(field),
                Some(field) if step.is_none() && field.map().is_some() => Quantity::Mapped(field),
                Some(field) if step.is_none() => Quantity::Found(field),
                _ => return Err(AtlasError::NotStored { quantity: name.to_owned() }),
            },
        };
        Ok(Self { of, component: input.component, step })
    }

    pub(super) fn value(&self, mesh: &Textured<'_>, triangle: &Triangle, weights: [f64; 3]) -> f32 {
        let (c, at) = (self.component, (triangle, weights));
        match self.of {
            Quantity::Color => mesh.map(|maps| maps.color.as_ref(), [1.0; 3], at)[c],
            Quantity::Specular => mesh.map(|maps| maps.specular.as_ref(), [1.0], at)[0],
            Quantity::Attenuator => mesh.map(|maps| maps.attenuator.as_ref(), [1.0], at)[0],
            Quantity::NormalMap => mesh.map(|maps| maps.normal.as_ref(), [0.5, 0.5, 1.0], at)[c],
            Quantity::Mapped(field) => {
                let neutral = field.info().neutral;
                match field.info().numbers {
                    1 => mesh.map(|maps| maps.scalar(field), [neutral], at)[0],
                    _ => mesh.map(|maps| maps.colored(field), [neutral; 3], at)[c],
                }
            }
            Quantity::Found(field) => {
                let mut numbers = [0.0; fields::MOST_NUMBERS];
                (mesh.find)(field, triangle.hit(weights), &mut numbers[..field.info().numbers]);
                numbers[c]
            }
            _ => {
                let weights = self.step.map_or(weights, |axis| triangle.steps()[axis]);
                (0..3).map(|i| weights[i] * self.of_vertex(mesh, triangle.vertices[i])).sum::<f64>() as f32
            }
        }
    }

    /// Of a vertex; 0 where the mesh lacks it, but for the open share of the hemisphere.
    fn of_vertex(&self, mesh: &Textured<'_>, i: usize) -> f64 {
        let PosedMesh { positions, normals, tangents, uvs, .. } = mesh.posed;
        let vector = |of: &[Vec3]| of.get(i).map_or(0.0, |v| v[self.component]);
        let tangent = || tangents.get(i).copied().unwrap_or(Vec4::ZERO);
        f64::from(match self.of {
            Quantity::Position => vector(positions),
            Quantity::Normal => vector(normals),
            Quantity::Tangent => tangent()[self.component],
            Quantity::Bitangent => {
                let (n, t) = (normals.get(i).copied().unwrap_or_default(), tangent());
                (t.w * n.cross(t.truncate()).normalize_or_zero())[self.component]
            }
            Quantity::Uv => uvs.get(i).map_or(0.0, |uv| uv[self.component]),
            Quantity::Declared(field) => {
                let held = mesh.posed.fields.iter().find(|held| held.field == field);
                held.map_or(field.info().neutral, |held| held.of(i)[self.component])
            }
            _ => mesh.occlusion.and_then(|open| open.get(i).copied()).unwrap_or(1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::super::texel_cover::{EMPTY, Listed, listed, overlap};
    use super::*;
    use crate::model::texture_filter::TextureFilter;

    fn mesh(uvs: &[[f32; 2]], triangles: &[[u32; 3]]) -> Textured<'static> {
        let posed = PosedMesh {
            positions: uvs.iter().map(|&[u, v]| Vec3::new(3.0 * u, v, 1.0)).collect(),
            uvs: uvs.iter().copied().map(Vec2::from).collect(),
            triangles: triangles.to_vec(),
            ..PosedMesh::default()
        };
        let maps = Box::leak(Box::<Maps>::default());
        let find = &|field: fields::Field, _, numbers: &mut [f32]| numbers.fill(field.info().neutral);
        let posed: &PosedMesh = Box::leak(Box::new(posed));
        let layout = Layout { uvs: &posed.uvs, triangles: &posed.triangles, size: 8 };
        Textured { posed, occlusion: None, maps, mip_maps: None, find, layout }
    }

    #[test]
    fn centres_on_shared_edges_belong_to_one_triangle_and_on_outer_ones_to_the_top_and_left() {
        // From centre to centre: a square whose edges and diagonal go through centres.
        let [low, high] = [1.5 / 8.0, 4.5 / 8.0];
        let corners = [[low, low], [high, low], [high, high], [low, high]];
        for triangles in [[[0, 1, 2], [0, 2, 3]], [[2, 1, 0], [3, 2, 0]]] {
            let (shown, again) = mesh(&corners, &triangles).layout.cover();
            assert_eq!(again, 0.0);
            for (i, shown) in shown.iter().enumerate() {
                let inside = (1..4).contains(&(i % 8)) && (1..4).contains(&(i / 8));
                assert_eq!(*shown != EMPTY, inside, "{} {}", i % 8, i / 8);
            }
        }
    }

    #[test]
    fn of_triangles_that_overlap_the_later_one_stays_and_steps_are_exact() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let mesh = mesh(&corners, &[[0, 1, 2], [2, 1, 0], [0, 0, 1]]);
        let (shown, again) = mesh.layout.cover();
        // Two lie on one another.
        assert_eq!(again, 1.0);
        assert!(shown.iter().all(|&triangle| triangle == 1 || triangle == EMPTY));
        assert!((27..=36).contains(&shown.iter().filter(|&&triangle| triangle == 1).count()));
        let triangle = mesh.layout.triangle(1);
        let input = |name: &str, component| Input { name: name.to_owned(), component };
        let value = |name, component| {
            let field = Field::of(&input(name, component)).unwrap();
            field.value(&mesh, &triangle, triangle.weights(DVec2::new(2.5, 1.5)))
        };
        // All of these are sums of few halves.
        assert_eq!([value("vertex_position", 0), value("vertex_uv", 1)], [3.0 * 2.5 / 8.0, 1.5 / 8.0]);
        assert_eq!([value("dpdx_vertex_position", 0), value("dpdy_vertex_position", 0)], [3.0 / 8.0, 0.0]);
        assert_eq!(value("vertex_occlusion", 0), 1.0);
        let error = Field::of(&input("dpdx_albedo", 0)).err().unwrap();
        assert_eq!(error, AtlasError::NotStored { quantity: "albedo".to_owned() });
    }

    #[test]
    fn maps_are_read_over_a_texel_where_they_are_filtered() {
        // Checks of a texel, 64 texels a side, of which one of the atlas covers eight.
        let check = |i: usize| [((i % 64 + i / 64) % 2) as f32];
        let specular = Some(Map { width: 64, height: 64, texels: (0..64 * 64).map(check).collect() });
        let maps = Maps { specular, ..Maps::default() };
        let value = |mip_maps: Option<&MipMaps>| {
            let bare = mesh(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], &[[0, 1, 2]]);
            let mesh = Textured { maps: &maps, mip_maps, ..bare };
            let field = Field::of(&Input { name: "specular".to_owned(), component: 0 }).unwrap();
            let triangle = mesh.layout.triangle(0);
            // At the centre of a texel of the map.
            field.value(&mesh, &triangle, triangle.weights(DVec2::splat(2.5 + 1.0 / 16.0)))
        };
        assert_eq!(value(None), 0.0);
        for filter in [TextureFilter::Trilinear, TextureFilter::Anisotropic] {
            assert_eq!(value(MipMaps::new(&maps, filter).as_ref()), 0.5);
        }
    }

    #[test]
    fn maps_that_lie_elsewhere_than_the_atlas_are_read_there_over_what_a_texel_covers_of_them() {
        // Mirrored along u at half the pace, along v at a quarter of it.
        let of_maps = [[0.5, 0.0], [0.0, 0.0], [0.5, 0.25]].map(Vec2::from).to_vec();
        let of_atlas = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let bare = mesh(&of_atlas, &[[0, 1, 2]]);
        let own_atlas_uvs = of_atlas.map(Vec2::from).to_vec();
        let posed = PosedMesh { uvs: of_maps, own_atlas_uvs, ..bare.posed.clone() };
        let columns = (0..64 * 64).map(|i| [(i % 64) as f32]).collect();
        let maps = Maps { specular: Some(Map { width: 64, height: 64, texels: columns }), ..Maps::default() };
        let layout = Layout { uvs: posed.atlas_uvs(), ..bare.layout };
        let mesh = Textured { posed: &posed, maps: &maps, layout, ..bare };
        let triangle = mesh.layout.triangle(0);
        let weights = triangle.weights(DVec2::new(2.5, 1.5));
        let value = |name: &str, component| {
            let field = Field::of(&Input { name: name.to_owned(), component }).unwrap();
            field.value(&mesh, &triangle, weights)
        };
        // At u = 0.5 - 2.5 / 16, half a texel beyond the centre of column 21; all of these are sums of few halves.
        assert_eq!([value("vertex_uv", 0), value("vertex_uv", 1)], [0.34375, 0.046875]);
        assert_eq!(value("specular", 0), 21.5);
        assert_eq!(mesh.footprint(&triangle), Footprint::new([-0.0625, 0.0], [0.0, 0.03125]));
    }

    #[test]
    fn a_mesh_must_lie_in_the_atlas() {
        let uvs = [Vec2::new(0.5, 0.5), Vec2::new(1.5, -0.5)];
        assert_eq!(overlap(&uvs, &[[0, 1, 0]], 8).unwrap_err(), AtlasError::Outside { u: 1.0, v: -1.0 });
        assert_eq!(overlap(&[], &[], 8).unwrap_err(), AtlasError::NoUvs);
    }

    #[test]
    fn a_list_of_texels_says_where_on_the_mesh_each_is() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Vec2::from);
        for triangle in [[0, 1, 2], [2, 1, 0]] {
            let texels = listed(&corners, &[triangle], 8).unwrap();
            assert!((27..=36).contains(&texels.len()));
            for Listed { texel, triangle: index, shares: [b, c] } in texels {
                let weights = [1.0 - b - c, b, c];
                let uv: Vec2 = (0..3).map(|i| weights[i] * corners[triangle[i] as usize]).sum();
                // Halves and quarters of eighths.
                assert_eq!((8.0 * uv).to_array(), texel.map(|x| x as f32 + 0.5));
                assert_eq!(index, 0);
            }
        }
    }
}
