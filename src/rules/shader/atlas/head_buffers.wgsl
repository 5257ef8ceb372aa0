
// Every level, one after another: a quantity in x, y and z of each texel of the atlas, row by row, and in w its chart.
@group(1) @binding(0) var<storage, read_write> levels: array<vec4f>;
// The texels that the mesh covers: their places, and charts.
@group(1) @binding(1) var<storage, read> texels: array<vec2u>;
// What these hold, sixteen a record.
@group(1) @binding(2) var<storage, read> records: array<f32>;
// The first texel of each workgroup of a blur, column in the low half and row in the high one.
@group(1) @binding(3) var<storage, read> tiles: array<u32>;
const SIZE = {size};

fn level_texel(level: u32, place: vec2i) -> vec4f {
    return levels[level + u32(place.y * SIZE + place.x)];
}

fn leave(level: u32, place: vec2i, value: vec4f) {
    levels[level + u32(place.y * SIZE + place.x)] = value;
}

fn is_inside(place: vec2i) -> bool {
    return all(place >= vec2i(0)) && all(place < vec2i(SIZE));
}
