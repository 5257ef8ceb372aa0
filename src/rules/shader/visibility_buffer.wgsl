
// How far a triangle goes on beyond its border, as a share of it.
const BEYOND = 0.5;

// Four threads in a row shade a square, as fragments do: what they look up lies together, and samplers that take the steps
// of texture coordinates from threads, whatever they are told, take the right ones (llvmpipe's anisotropic one).
fn place_in_tile(i: u32) -> vec2u {
    let x = (i & 1u) | ((i >> 1u) & 2u) | ((i >> 2u) & 4u);
    let y = ((i >> 1u) & 1u) | ((i >> 2u) & 2u) | ((i >> 3u) & 4u);
    return vec2u(x, y);
}

fn clip_of(first: u32) -> vec3f {
    return vec3f(varyings[first], varyings[first + 1u], varyings[first + 3u]);
}

// Barycentric coordinates of a sample, in perspective, times their sum (Olano and Greer 1997, "Triangle Scan Conversion
// using 2D Homogeneous Coordinates"); linear over the image. Corners are taken relative to the sample before anything is
// multiplied: what cancels then is as small as the triangle.
fn areas_of_corners(first: vec3u, at: vec2f) -> vec3f {
    let place = vec2f(2.0, -2.0) * at / vec2f(drawn.xy) + vec2f(-1.0, 1.0);
    let clip_a = clip_of(first.x);
    let clip_b = clip_of(first.y);
    let clip_c = clip_of(first.z);
    let a = clip_a.xy - clip_a.z * place;
    let b = clip_b.xy - clip_b.z * place;
    let c = clip_c.xy - clip_c.z * place;
    return vec3f(b.x * c.y - b.y * c.x, c.x * a.y - c.y * a.x, a.x * b.y - a.y * b.x);
}

// A sample may lie outside of the triangle that it shows by as much as the rasteriser snaps corners to a grid. Its surface
// goes on there as far as a share of it, as near as the neighbour's to that; where all of it is narrower than the grid, the
// border stands in.
fn shares_of(areas: vec3f) -> vec3f {
    let sum = areas.x + areas.y + areas.z;
    let shares = areas / sum;
    if (min(shares.x, min(shares.y, shares.z)) >= -BEYOND) {
        return shares;
    }
    let inside = max(select(-areas, areas, sum >= 0.0), vec3f(0.0));
    let whole = inside.x + inside.y + inside.z;
    return select(vec3f(1.0 / 3.0), inside / whole, whole > 0.0);
}

// How the coordinates change to a neighbour with these areas, as fast as they do at the sample: the neighbour may be
// beyond the triangle's horizon.
fn step_of(areas: vec3f, neighbour: vec3f) -> vec3f {
    let change = neighbour - areas;
    let sum = areas.x + areas.y + areas.z;
    let step = (change - (change.x + change.y + change.z) * shares_of(areas)) / sum;
    return select(vec3f(0.0), step, sum != 0.0);
}
