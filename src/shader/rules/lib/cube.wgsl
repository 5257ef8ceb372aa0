// Where a direction of any length from 1e-36 on meets the cube: the face in x (+X -X +Y -Y +Z -Z), then s and
// t in [0, 1]. A shorter or non-finite direction has no face; +Z stands in. Ties of the major axis go to x
// before y before z; seamlessness makes the choice immaterial.
fn cube_place(direction: vec3f) -> vec3f {
    let size = abs(direction.x) + abs(direction.y) + abs(direction.z);
    let ok = size >= 1e-36 && is_finite(direction);
    let d = select(vec3f(0.0, 0.0, 1.0), direction, ok);
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z {
        let sc = select(d.z, -d.z, d.x >= 0.0);
        return vec3f(select(1.0, 0.0, d.x >= 0.0), 0.5 * vec2f(sc, -d.y) / a.x + 0.5);
    }
    if a.y >= a.z {
        let tc = select(-d.z, d.z, d.y >= 0.0);
        return vec3f(select(3.0, 2.0, d.y >= 0.0), 0.5 * vec2f(d.x, tc) / a.y + 0.5);
    }
    let sc = select(-d.x, d.x, d.z >= 0.0);
    return vec3f(select(5.0, 4.0, d.z >= 0.0), 0.5 * vec2f(sc, -d.y) / a.z + 0.5);
}

// The seamless bilinear lookup in faces that carry a border of one texel from their neighbours.
fn sample_faces(faces: texture_2d_array<f32>, place: vec3f) -> vec4f {
    let size = f32(textureDimensions(faces).x - 2u);
    let at = place.yz * size + 0.5;
    let low = clamp(floor(at), vec2f(0.0), vec2f(size));
    let f = at - low;
    let i = vec2i(low);
    let face = i32(place.x);
    let a = textureLoad(faces, i, face, 0);
    let b = textureLoad(faces, i + vec2i(1, 0), face, 0);
    let c = textureLoad(faces, i + vec2i(0, 1), face, 0);
    let d = textureLoad(faces, i + vec2i(1, 1), face, 0);
    return mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
}
