
// Where the numbers of a triangle's corners begin.
fn first_numbers(triangle: u32) -> vec3u {
    return STRIDE * vec3u(corners[3u * triangle], corners[3u * triangle + 1u], corners[3u * triangle + 2u]);
}

// What the corners hold there, each counting its share.
fn mean_of_corners(first: vec3u, number: u32, shares: vec3f) -> f32 {
    return shares.x * varyings[first.x + number] + shares.y * varyings[first.y + number]
        + shares.z * varyings[first.z + number];
}
