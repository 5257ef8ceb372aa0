// cube_place along d_direction, the face held. No direction turns faster than one of length 1e-6, as on the CPU:
// beyond, squares of derivatives overflow. What has no face does not move.
fn cube_place_tangent(direction: vec3f, d_direction: vec3f) -> vec3f {
    let size: f32 = abs(direction.x) + abs(direction.y) + abs(direction.z);
    if !(size >= 1e-36 && is_finite(direction)) {
        return vec3f();
    }
    let place: vec3f = cube_place(direction);
    let side: f32 = select(-1.0, 1.0, place.x % 2.0 < 0.5);
    var across = vec3f(-side * d_direction.z, -d_direction.y, side * d_direction.x);
    var major: f32 = direction.x;
    if place.x > 3.5 {
        across = vec3f(side * d_direction.x, -d_direction.y, side * d_direction.z);
        major = direction.z;
    } else if place.x > 1.5 {
        across = vec3f(d_direction.x, side * d_direction.z, side * d_direction.y);
        major = direction.y;
    }
    // s = (sc / |major| + 1) / 2.
    let moved: vec2f = 0.5 * across.xy - across.z * (place.yz - 0.5);
    return vec3f(0.0, moved * min(1.0 / abs(major), 1e6));
}
