// The cube's face that a direction meets: its axis (z where neither x nor y), and the side of it.
struct CubeFace {
    x_major: bool,
    y_major: bool,
    side: f32,
}

// Ties of the major axis go to x before y before z; seamlessness makes the choice immaterial. Without branches: with
// them, a fit's pass on a graphics card takes longer (docs/gpu-engine.md).
fn face_met(direction: vec3f) -> CubeFace {
    let a = abs(direction);
    let x_major = (a.x >= a.y) & (a.x >= a.z);
    let y_major = a.y >= a.z;
    let major = select(select(direction.z, direction.y, y_major), direction.x, x_major);
    return CubeFace(x_major, y_major, select(-1.0, 1.0, major >= 0.0));
}

// v in the axes of a face: along s, along t, and outwards. Linear in v.
fn on_face(v: vec3f, face: CubeFace) -> vec3f {
    let on_y = vec3f(v.x, face.side * v.z, face.side * v.y);
    let on_z = vec3f(face.side * v.x, -v.y, face.side * v.z);
    return select(select(on_z, on_y, face.y_major), vec3f(-face.side * v.z, -v.y, face.side * v.x), face.x_major);
}

// Where a unit vector meets the cube: the face in x (+X -X +Y -Y +Z -Z), then s and t in [0, 1]. The zero vector
// meets the middle of a face.
fn cube_place_of_unit(direction: vec3f) -> vec3f {
    let face = face_met(direction);
    let index = select(select(4.0, 2.0, face.y_major), 0.0, face.x_major) + select(1.0, 0.0, face.side > 0.0);
    let d = on_face(direction, face);
    return vec3f(index, 0.5 * d.xy / max(d.z, 1e-36) + 0.5);
}

// Where a direction of any length from 1e-36 on meets the cube. A shorter or non-finite direction has no face;
// +Z stands in.
fn cube_place(direction: vec3f) -> vec3f {
    let size = abs(direction.x) + abs(direction.y) + abs(direction.z);
    let ok = size >= 1e-36 && is_finite(direction);
    return cube_place_of_unit(select(vec3f(0.0, 0.0, 1.0), direction, ok));
}

// The seamless bilinear lookup in faces of `size` texels a side, which carry a border of one texel from their
// neighbours: a place in [0, 1] is half a texel or more from where the border ends.
fn sample_faces(faces: texture_2d_array<f32>, size: f32, place: vec3f) -> vec4f {
    let at = place.yz * size + 0.5;
    let low = floor(at);
    let f = at - low;
    let i = vec2i(low);
    let face = i32(place.x);
    let a = textureLoad(faces, i, face, 0);
    let b = textureLoad(faces, i + vec2i(1, 0), face, 0);
    let c = textureLoad(faces, i + vec2i(0, 1), face, 0);
    let d = textureLoad(faces, i + vec2i(1, 1), face, 0);
    // a + (b - a) f in the place of `mix`, as the CPU engine's vectors have it: an operation less.
    let upper = a + (b - a) * f.x;
    let lower = c + (d - c) * f.x;
    return upper + (lower - upper) * f.y;
}
