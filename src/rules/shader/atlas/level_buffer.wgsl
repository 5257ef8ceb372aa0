// Where a level begins in the buffer of all.
alias Level = u32;

fn level_size(level: Level) -> vec2i {
    return vec2i(SIZE);
}

fn level_texel(level: Level, place: vec2i) -> vec4f {
    return levels[level + u32(place.y * SIZE + place.x)];
}

