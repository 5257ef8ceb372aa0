//! What lights see of a mesh: a layer of the shadow maps each way.

use glam::{DMat3, DMat4, DVec3, DVec4, Vec3};

use crate::model::effects::{Effect, Effects};
use crate::model::params::{Param, Params};
use crate::model::shadow_filter::ShadowFilter;
use crate::scene::light::{Beam, Cone, Lamp, Light, LightKind};
use crate::scene::{Scene, ShadowMaps};

/// Rows a layer in `shadow_views`.
pub(super) const ROWS: usize = 7;
/// Layers of a light that shines to all sides.
const ALL_SIDES: usize = 6;
/// A spot that is wider takes six layers: in one, most texels would lie at its edge.
const WIDEST_SPOT: f64 = 60.0;
/// Texels beyond what is lit, which the filter blends with.
const MARGIN: f64 = 2.0;
/// A lamp's near plane and the nearest blockers, as shares of how far the mesh reaches from it.
const NEAR: f64 = 1e-5;
const NEAREST: f64 = 1e-3;
/// How far in front of the mesh and behind it parallel light's depth goes, as a share of the mesh.
const PAD: f64 = 1e-3;

/// A light that has a map, and its first layer.
#[derive(Clone, PartialEq)]
pub(crate) struct Mapped {
    pub(super) light: Light,
    pub(super) first: usize,
}

impl Mapped {
    /// The layers that it takes.
    pub(super) fn layers(&self) -> usize {
        match &self.light.kind {
            LightKind::Directional(_) => 1,
            LightKind::Spot(_, cone) if cone.outer_degrees <= WIDEST_SPOT => 1,
            LightKind::Point(_) | LightKind::Spot(..) => ALL_SIDES,
        }
    }
}

/// One layer: world to clip space, and its rows in `shadow_views`.
pub(super) struct View {
    pub(super) matrix: DMat4,
    pub(super) rows: [[f32; 4]; ROWS],
}

/// The lights of a scene that have maps, in the order of their layers: those that shine and have a direction. None where
/// the scene does not ask for maps.
pub(crate) fn mapped(scene: &Scene, params: &Params) -> Vec<Mapped> {
    let shaded = [Effect::Lights, Effect::Shadows].into_iter().all(|effect| scene.effects.has(effect));
    if !shaded || scene.shadow_maps.filter == ShadowFilter::Vertices {
        return Vec::new();
    }
    let mut maps: Vec<Mapped> = Vec::new();
    for light in scene.lights_at(params) {
        if shines(&light, scene.effects, params) {
            let first = maps.last().map_or(0, |last| last.first + last.layers());
            maps.push(Mapped { light, first });
        }
    }
    maps
}

/// The parameters with each light's first layer among them.
pub(crate) fn with_layers(mut params: Params, maps: &[Mapped]) -> Params {
    for map in maps {
        let name = format!("light.{}.shadow_map", map.light.member());
        if let Some(param) = Param::from_name(&name) {
            params.set(param, map.first as f64);
        }
    }
    params
}

/// Whether a light brings anything.
fn shines(light: &Light, effects: Effects, params: &Params) -> bool {
    let member = light.member();
    let enabled = Effect::from_name(&format!("light_{member}")).is_some_and(|effect| effects.has(effect));
    let color =
        Param::from_name(&format!("light.{member}.color")).map_or([1.0; 3], |color| params.rgb(color));
    let strength = light.strength();
    let directed = match &light.kind {
        LightKind::Directional(_) => light.towards(DVec3::ZERO) != DVec3::ZERO,
        LightKind::Point(_) => true,
        LightKind::Spot(_, cone) => cone.direction != DVec3::ZERO,
    };
    enabled && directed && (0..3).any(|c| color[c] * strength[c] != 0.0)
}

/// The box around the vertices of a mesh; around the origin where it has none that are finite.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    /// Around what `to` makes of each place.
    fn new(places: &[Vec3], to: impl Fn(DVec3) -> DVec3) -> Self {
        let places = places.iter().filter(|place| place.is_finite()).map(|place| to(place.as_dvec3()));
        let around = |all: Option<Self>, place: DVec3| {
            Some(all.map_or(Self { low: place, high: place }, |Self { low, high }| Self {
                low: low.min(place),
                high: high.max(place),
            }))
        };
        places.fold(None, around).unwrap_or(Self { low: DVec3::ZERO, high: DVec3::ZERO })
    }

    /// How far it reaches along its longest side, or a rounding of where it is: not 0.
    fn length(&self) -> f64 {
        let rounding = 1e-5 * self.low.abs().max(self.high.abs()).max_element();
        (self.high - self.low).max_element().max(rounding).max(1e-20)
    }

    /// How near to a place it comes, and how far it reaches from there.
    fn distances(&self, from: DVec3) -> [f64; 2] {
        let outside = (self.low - from).max(from - self.high).max(DVec3::ZERO);
        let furthest = (self.low - from).abs().max((self.high - from).abs());
        [outside.length(), furthest.length().max(1e-6 * from.length()).max(1e-20)]
    }
}

/// The layers of a light over a mesh with these vertices.
pub(super) fn views(map: &Mapped, maps: &ShadowMaps, places: &[Vec3]) -> Vec<View> {
    match &map.light.kind {
        LightKind::Directional(beam) => {
            vec![of_beam(beam, map.light.towards(DVec3::ZERO), maps, places)]
        }
        LightKind::Spot(lamp, cone) if map.layers() == 1 => {
            vec![of_lamp(lamp, axes(cone.direction), cone_tangent(cone), 1, maps, places)]
        }
        LightKind::Point(lamp) | LightKind::Spot(lamp, _) => {
            let side = |axis: DMat3| of_lamp(lamp, axis, 1.0, ALL_SIDES, maps, places);
            sides().map(side).into()
        }
    }
}

/// From a share of a map's side that is lit to all of it.
fn widened(size: u32) -> f64 {
    let size = f64::from(size);
    size / (size - 2.0 * MARGIN)
}

fn of_beam(beam: &Beam, toward: DVec3, maps: &ShadowMaps, places: &[Vec3]) -> View {
    let to = axes(toward).transpose();
    let bounds = Bounds::new(places, |place| to * place);
    let length = bounds.length();
    let across = (bounds.high - bounds.low).truncate().max_element().max(1e-3 * length) * widened(maps.size);
    let middle = 0.5 * (bounds.low + bounds.high);
    let range = (bounds.high.z - bounds.low.z) + 2.0 * PAD * length;
    let scale = DVec3::new(2.0 / across, 2.0 / across, 1.0 / range);
    let start = DVec3::new(middle.x, middle.y, bounds.low.z - PAD * length);
    let turned = DMat4::from_mat3(DMat3::from_diagonal(scale) * to);
    let matrix = DMat4::from_translation(-scale * start) * turned;
    let softness = (0.5 * beam.angular_diameter_degrees.to_radians()).tan();
    let texel = across / f64::from(maps.size);
    View::new(matrix, toward.extend(0.0), [texel, 1.0], [softness, range, 0.0], maps)
}

/// A frame whose third column is a direction.
fn axes(direction: DVec3) -> DMat3 {
    let along = direction.try_normalize().unwrap_or(DVec3::Z);
    let (a, b) = along.any_orthonormal_pair();
    DMat3::from_cols(a, b, along)
}

/// The tangent of the angle that a spot's map shows, from its axis.
fn cone_tangent(cone: &Cone) -> f64 {
    cone.outer_degrees.max(0.1).to_radians().tan()
}

/// What a lamp sees along the third column of `axis`.
fn of_lamp(
    lamp: &Lamp,
    axis: DMat3,
    tangent: f64,
    layers: usize,
    maps: &ShadowMaps,
    places: &[Vec3],
) -> View {
    let [nearest, furthest] = Bounds::new(places, |place| place).distances(lamp.position);
    let tangent = tangent * widened(maps.size);
    let near = NEAR * furthest;
    let to = axis.transpose();
    // x and y by the tangent, z = near, w the distance along the axis: depth is near / distance, equally fine anywhere.
    let [x, y, along] = [to.row(0) / tangent, to.row(1) / tangent, to.row(2)];
    let row = |row: DVec3| row.extend(-row.dot(lamp.position));
    let matrix = DMat4::from_cols(row(x), row(y), DVec4::new(0.0, 0.0, 0.0, near), row(along)).transpose();
    let texel = 2.0 * tangent / f64::from(maps.size);
    let nearest = nearest.max(lamp.radius).max(NEAREST * furthest);
    View::new(matrix, lamp.position.extend(1.0), [texel, layers as f64], [lamp.radius, near, nearest], maps)
}

/// The axes of six layers, +X -X +Y -Y +Z -Z, each in the third column.
fn sides() -> [DMat3; ALL_SIDES] {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    [[y, z, x], [z, y, -x], [z, x, y], [x, z, -y], [x, y, z], [y, x, -z]]
        .map(|[a, b, c]| DMat3::from_cols(a, b, c))
}

impl View {
    fn new(
        matrix: DMat4,
        light: DVec4,
        [texel, layers]: [f64; 2],
        [softness, depth, nearest]: [f64; 3],
        maps: &ShadowMaps,
    ) -> Self {
        let about = [
            light,
            DVec4::new(texel, maps.bias, maps.radius, layers),
            DVec4::new(softness, depth, nearest, f64::from(maps.size)),
        ];
        let columns = [0, 1, 2, 3].map(|i| matrix.col(i));
        let rows: Vec<[f32; 4]> = columns.iter().chain(&about).map(|row| row.as_vec4().to_array()).collect();
        let mut all = [[0.0; 4]; ROWS];
        all.copy_from_slice(&rows);
        Self { matrix, rows: all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(kind: LightKind) -> Mapped {
        Mapped { light: Light { name: "l".to_owned(), kind }, first: 0 }
    }

    fn beam(direction: DVec3) -> Mapped {
        light(LightKind::Directional(Beam { direction, irradiance: [1.0; 3], angular_diameter_degrees: 1.0 }))
    }

    fn lamp(position: DVec3) -> Lamp {
        Lamp { position, intensity: [1.0; 3], range: None, radius: 0.1 }
    }

    fn places() -> Vec<Vec3> {
        let coordinate = |i: usize, n: usize| ((i * n) % 17) as f32 / 5.0 - 1.2;
        (0..60).map(|i| Vec3::new(coordinate(i, 5), 7.0 + coordinate(i, 3), coordinate(i, 11))).collect()
    }

    /// Where a layer shows a place, and how deep.
    fn shown(view: &View, place: DVec3) -> (DVec3, f64) {
        let clip = view.matrix * place.extend(1.0);
        (clip.truncate() / clip.w, clip.w)
    }

    #[test]
    fn parallel_light_sees_all_of_the_mesh_and_what_is_nearer_is_greater() {
        let direction = DVec3::new(0.3, -1.0, 0.2).normalize();
        let [view] = &views(&beam(direction), &ShadowMaps::default(), &places())[..] else { panic!() };
        for place in places() {
            let (at, w) = shown(view, place.as_dvec3());
            assert!(
                at.x.abs() < 1.0 && at.y.abs() < 1.0 && at.z > 0.0 && at.z < 1.0 && w == 1.0,
                "{place} {at}"
            );
            let (nearer, _) = shown(view, place.as_dvec3() - 1e-3 * direction);
            // The same place on the map, but for roundings of f64.
            assert!(nearer.z > at.z && (nearer - at).truncate().length() < 1e-12);
        }
        let [.., light, about, width] = view.rows;
        assert!(light[3] == 0.0 && (f64::from(light[1]) + direction.y).abs() < 1e-6, "{light:?}");
        // A step of one texel along the map.
        let step = 2.0 / view.matrix.row(0).truncate().length() / f64::from(width[3]);
        assert!((step / f64::from(about[0]) - 1.0).abs() < 1e-6, "{step} {about:?}");
    }

    #[test]
    fn a_point_light_sees_every_way_on_one_of_six_sides() {
        let eye = DVec3::new(0.2, 6.8, -0.1);
        let map = light(LightKind::Point(lamp(eye)));
        let sides = views(&map, &ShadowMaps { size: 64, ..ShadowMaps::default() }, &places());
        assert_eq!((sides.len(), map.layers()), (6, 6));
        for place in places() {
            let way = place.as_dvec3() - eye;
            let size = way.abs();
            // As the shader chooses.
            let axis = (0..3).fold(0, |most, i| if size[i] > size[most] { i } else { most });
            let side = &sides[2 * axis + usize::from(way[axis] < 0.0)];
            let (at, w) = shown(side, place.as_dvec3());
            // Within the texels beyond which the filter blends.
            let edge = 1.0 - 2.0 * (MARGIN - 0.01) / 64.0;
            assert!(at.x.abs() < edge && at.y.abs() < edge && (w - size[axis]).abs() < 1e-12, "{way} {at}");
            let near = f64::from(side.rows[6][1]);
            assert!((at.z - near / w).abs() < 1e-9, "{} {near} {w}", at.z);
        }
    }

    #[test]
    fn a_narrow_spot_takes_one_map_that_holds_its_cone_and_a_wide_one_six() {
        let spot = |outer_degrees: f64| {
            let cone = Cone { direction: DVec3::NEG_Z, inner_degrees: 0.0, outer_degrees };
            light(LightKind::Spot(lamp(DVec3::new(0.0, 7.0, 5.0)), cone))
        };
        let narrow = spot(25.0);
        let [view] = &views(&narrow, &ShadowMaps::default(), &places())[..] else { panic!() };
        let edge = DVec3::new(0.0, 7.0 + 25.0_f64.to_radians().tan() * 4.9, 0.1);
        let (at, w) = shown(view, edge);
        let reach = at.truncate().length();
        assert!(reach < 1.0 && reach > 0.99 && (w - 4.9).abs() < 1e-12, "{at} {w}");
        assert_eq!(views(&spot(75.0), &ShadowMaps::default(), &places()).len(), 6);
    }

    #[test]
    fn whatever_the_mesh_the_rows_are_finite() {
        let nothing: [Vec<Vec3>; 5] = [
            Vec::new(),
            vec![Vec3::ZERO; 3],
            vec![Vec3::NAN; 3],
            vec![Vec3::splat(1e6); 3],
            vec![Vec3::new(0.0, 1e-30, 0.0), Vec3::ZERO, Vec3::X * 1e-30],
        ];
        for places in nothing {
            for map in
                [beam(DVec3::NEG_Y), beam(DVec3::ONE.normalize()), light(LightKind::Point(lamp(DVec3::ZERO)))]
            {
                for view in views(&map, &ShadowMaps { size: 16, ..ShadowMaps::default() }, &places) {
                    assert!(view.rows.iter().flatten().all(|x| x.is_finite()), "{places:?} {:?}", view.rows);
                }
            }
        }
    }
}
