// The roughness m that every formula takes (MODEL 9): s may lower it. At the bound the product moves it.
fn specular_roughness(roughness: f32, gloss: f32, s: f32) -> f32 {
    return max(0.05, roughness * (1.0 - gloss * s));
}

// Schlick's Fresnel factor at the cosine of (H, V').
fn schlick_fresnel(cosine: f32, f0: f32) -> f32 {
    let away: f32 = 1.0 - cosine;
    let square: f32 = away * away;
    return f0 + (1.0 - f0) * (square * square * away);
}

// The unpolarised Fresnel factor of a dielectric, eta = (1 + q) / (1 - q), q = sqrt f0, at the cosine u of (H, V'); 1 from
// f0 = 1 on. With e = eta^2 - 1 = 4 q / (1 - q)^2 and g = sqrt(u^2 + e) the usual g - u is e / (g + u), and the factor f0
// stands outside: value and derivative hold at f0 = 0 too, where 1e-24 stands under the root. g + u is held at 0.1: from
// u = 0 the factor would rise to 1 as soon as f0 leaves 0; so its slope is 2e5 at most, and what reflects less than 6e-6
// when facing reflects less where both graze, too.
fn dielectric_fresnel(u: f32, f0: f32) -> f32 {
    let ok: bool = f0 < 1.0;
    let f: f32 = select(0.0, f0, ok);
    let q: f32 = sqrt(max(f, 1e-24));
    let rest: f32 = 1.0 - q;
    let e: f32 = 4.0 * q / (rest * rest);
    let g: f32 = sqrt(u * u + e);
    let sum: f32 = max(g + u, 0.1);
    let ratio: f32 = (u * sum - 1.0) / (u * (e / sum) + 1.0);
    let scale: f32 = rest * sum;
    let square: f32 = scale * scale;
    return select(1.0, 8.0 * f / (square * square) * (1.0 + ratio * ratio), ok);
}

// PH = exp(-tan^2 / m^2) / (m^2 cos^4), pi times Beckmann's distribution, from the squared sine and cosine of (N, H); 0
// where N.H <= 0.001.
fn beckmann(sine_squared: f32, cosine_squared: f32, m: f32) -> f32 {
    let ok: bool = cosine_squared > 1e-6;
    let cosine: f32 = select(1.0, cosine_squared, ok);
    let m2: f32 = m * m;
    return select(0.0, exp(-sine_squared / (cosine * m2)) / (m2 * cosine * cosine), ok);
}

// In the BRDFs n is the unit normal, `view` the unit vector from the eye to the surface, `toward` the unit vector towards
// the light, h = L + V'. The squared sine of (N, H) is |N x h|^2 / |h|^2: 1 - (N.H)^2 would cancel. The cosine of (H, V')
// is |h| / 2: H.V' would be what rounding leaves where L and V' are nearly opposite. 0 where light or view lie below the
// surface, or h is 0.

// The BRDF of Kelemen and Szirmay-Kalos (2001) over weight and s: PH F / (pi |h|^2), F Schlick's (MODEL 9).
fn kelemen_brdf(n: vec3f, view: vec3f, toward: vec3f, m: f32, f0: f32) -> f32 {
    let h: vec3f = toward - view;
    let squared: f32 = dot(h, h);
    let lit: bool = dot(n, toward) > 0.0 && dot(n, view) < 0.0 && squared > 1e-12;
    let size: f32 = select(1.0, squared, lit);
    let across: vec3f = cross(n, h);
    let along: f32 = dot(n, h);
    let ph: f32 = beckmann(dot(across, across) / size, along * along / size, m);
    let fresnel: f32 = schlick_fresnel(0.5 * sqrt(size), f0);
    return select(0.0, ph * fresnel / (3.1415927 * size), lit);
}

// GGX over weight and s: D G F / (4 (N.L)(N.V')), alpha = m^2, Smith's height-correlated G, F a dielectric's (MODEL 9).
fn ggx_brdf(n: vec3f, view: vec3f, toward: vec3f, m: f32, f0: f32) -> f32 {
    let h: vec3f = toward - view;
    let squared: f32 = dot(h, h);
    let nl: f32 = dot(n, toward);
    let nv: f32 = -dot(n, view);
    let lit: bool = nl > 0.0 && nv > 0.0 && squared > 1e-12;
    let size: f32 = select(1.0, squared, lit);
    let light: f32 = select(1.0, nl, lit);
    let eye: f32 = select(1.0, nv, lit);
    let across: vec3f = cross(n, h);
    let along: f32 = dot(n, h);
    let alpha: f32 = m * m;
    let a2: f32 = alpha * alpha;
    let spread: f32 = select(1.0, (dot(across, across) + a2 * (along * along)) / size, lit);
    // Where both graze it vanishes, and what it divides with it; held at 1e-6 slopes and their squares stay within an f32.
    let masked: f32 = max(eye * sqrt(a2 + (1.0 - a2) * (light * light)) + light * sqrt(a2 + (1.0 - a2) * (eye * eye)), 1e-6);
    let fresnel: f32 = dielectric_fresnel(select(1.0, 0.5 * sqrt(size), lit), f0);
    return select(0.0, a2 / (3.1415927 * spread * spread) * (0.5 / masked) * fresnel, lit);
}

// How much of the specular lobe is open: Lagarde and de Rousiers 2014, clamp((N.V' + occ)^(2^(-16 m - 1)) - 1 + occ, 0, 1),
// 0 where N.V' + occ is, and no steeper there than at 1e-6.
fn lagarde_visibility(view_cosine: f32, occ: f32, m: f32) -> f32 {
    let base: f32 = view_cosine + occ;
    let positive: bool = base > 0.0;
    let power: f32 = exp2(exp2(-16.0 * m - 1.0) * log2(max(base, 1e-6)));
    return min(max(select(0.0, power, positive) - 1.0 + occ, 0.0), 1.0);
}

// The direction that stands for the lobe's off-peak mean, not normalised (Lagarde and de Rousiers 2014); alpha is m for
// kelemen, m^2 for ggx. The root is held at 1e-6, so that its slope is finite at alpha = 1.
fn off_peak_direction(n: vec3f, mirrored: vec3f, alpha: f32) -> vec3f {
    let rest: f32 = 1.0 - alpha;
    return n + (rest * (sqrt(max(rest, 1e-12)) + alpha)) * (mirrored - n);
}

// The angle of a cosine in [-1, 1], to 7e-5 (Abramowitz and Stegun 4.4.45); its slope ends 1e-6 from 1 and -1.
fn arc_cosine(cosine: f32) -> f32 {
    let size: f32 = min(abs(cosine), 0.999999);
    let series: f32 = 1.5707288 + size * (-0.2121144 + size * (0.074261 - size * 0.0187293));
    let angle: f32 = sqrt(1.0 - size) * series;
    return select(3.1415927 - angle, angle, cosine >= 0.0);
}

// How much of the specular lobe is open, by cones: the share of the lobe's that lies in the visible one, of cos^2 = 1 - occ
// about the bent normal, which lies at `bent_cosine` from the mirrored view. The lobe's is of the cosine 10^(-alpha^2)
// (Jimenez et al. 2016), the overlap Oat and Sander's (Ambient aperture lighting, 2007). alpha is m for kelemen, m^2
// for ggx.
fn cone_visibility(bent_cosine: f32, occ: f32, alpha: f32) -> f32 {
    let open_cosine: f32 = sqrt(min(max(1.0 - occ, 1e-12), 1.0));
    let lobe_cosine: f32 = exp2(-3.3219281 * alpha * alpha);
    let open: f32 = arc_cosine(open_cosine);
    let lobe: f32 = arc_cosine(lobe_cosine);
    let nested: f32 = abs(open - lobe);
    let reach: f32 = max(open + lobe - nested, 1e-4);
    let inside: f32 = min(max(1.0 - (arc_cosine(bent_cosine) - nested) / reach, 0.0), 1.0);
    let overlap: f32 = inside * inside * (3.0 - 2.0 * inside);
    return overlap * (1.0 - max(open_cosine, lobe_cosine)) / (1.0 - lobe_cosine);
}
