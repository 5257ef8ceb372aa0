// The root of what a white furnace does not give back.
fn ggx_lost(x: f32, y: f32) -> f32 {
    let n0: f32 = 0.33402863 + y * (0.8169048 + y * (1.1159594 + y * (0.98953736 + y * (0.43588084 + y * (0.065510236 + y * -0.0009552404)))));
    let n1: f32 = 0.14000194 + y * (0.23218244 + y * (0.17092684 + y * (0.2242899 + y * (0.21750632 + y * 0.068374954))));
    let n2: f32 = -0.28881484 + y * (-0.548191 + y * (-0.73062694 + y * (-0.67116606 + y * -0.21717256)));
    let n3: f32 = -0.118345 + y * (-0.06769892 + y * (0.12458907 + y * 0.07943766));
    let n4: f32 = 0.030874906 + y * (-0.04464797 + y * -0.07123808);
    let n5: f32 = 0.0538048 + y * 0.051908348;
    let n6: f32 = -1.7619926e-5;
    let d0: f32 = 1.0 + y * (2.1456277 + y * (2.0888052 + y * (1.2266152 + y * (0.39047337 + y * (0.021489624 + y * 0.01910439)))));
    let d1: f32 = -0.3287131 + y * (-1.0613962 + y * (-0.93980634 + y * (-0.5418916 + y * (0.104449615 + y * 0.13202599))));
    let d2: f32 = -0.30175564 + y * (-0.6818513 + y * (-0.061905526 + y * (-0.23635323 + y * -0.21460491)));
    let d3: f32 = 0.028441945 + y * (-0.22436728 + y * (0.03721724 + y * 0.28821102));
    let d4: f32 = 0.12196547 + y * (0.024504509 + y * -0.40312576);
    let d5: f32 = 0.028908864 + y * 0.289092;
    let d6: f32 = -0.076890685;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * (n5 + x * n6)))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * (d5 + x * d6))))));
}

// 1 - H.V' in the mean of its fifth power.
fn ggx_mean(x: f32, y: f32) -> f32 {
    let n0: f32 = 0.6741336 + y * (0.6903103 + y * (0.56907827 + y * (0.39803347 + y * (0.16769876 + y * (0.054467313 + y * 0.004097922)))));
    let n1: f32 = -0.8031816 + y * (-0.30192694 + y * (0.2734349 + y * (0.17496519 + y * (0.088346556 + y * 0.0032113974))));
    let n2: f32 = 0.3300147 + y * (-0.10114283 + y * (-0.2795231 + y * (-0.18182829 + y * -0.083245605)));
    let n3: f32 = -0.123640515 + y * (-0.13024609 + y * (-0.25694197 + y * -0.12752292));
    let n4: f32 = -0.04703287 + y * (-0.025836136 + y * -0.047238994);
    let n5: f32 = 0.012005832 + y * 0.023392783;
    let n6: f32 = -0.0021322847;
    let d0: f32 = 1.0 + y * (1.4711362 + y * (1.3446758 + y * (0.92848355 + y * (0.47735128 + y * (0.17451948 + y * 0.026907355)))));
    let d1: f32 = -1.0577035 + y * (-0.5776807 + y * (0.598588 + y * (0.81282794 + y * (0.46971667 + y * 0.097185))));
    let d2: f32 = 0.51032424 + y * (0.12201066 + y * (-0.224091 + y * (-0.10191294 + y * -0.011935611)));
    let d3: f32 = -0.14282517 + y * (-0.19174358 + y * (-0.3291924 + y * -0.15704131));
    let d4: f32 = -0.040747643 + y * (-0.01577622 + y * -0.043345805);
    let d5: f32 = 0.02002914 + y * 0.030954488;
    let d6: f32 = -0.0021627273;
    return (n0 + x * (n1 + x * (n2 + x * (n3 + x * (n4 + x * (n5 + x * n6)))))) / (d0 + x * (d1 + x * (d2 + x * (d3 + x * (d4 + x * (d5 + x * d6))))));
}

// The split sum of ggx (MODEL 9): a and b, with which a constant environment of 1 is reflected as f0 a + b, at
// N.V' and a roughness of [0.05, 1], to 2e-4. At views that graze more than 1e-6 it stays: there its slope is
// infinite. Fitted to the exact integrals and printed by specular/fitted.rs; nobody writes here.
fn split_sum_ggx(view_cosine: f32, roughness: f32) -> vec2f {
    let view: f32 = max(view_cosine, 1e-6);
    let y: f32 = 2.1052632 * roughness - 1.1052631;
    let lost_layer: f32 = 1.0 * roughness;
    let lost: f32 = ggx_lost(2.0 * sqrt(view * (1.0 + lost_layer) / (view + lost_layer)) - 1.0, y);
    let mean_layer: f32 = 2.0 * roughness * roughness;
    let mean: f32 = max(ggx_mean(2.0 * sqrt(view * (1.0 + mean_layer) / (view + mean_layer)) - 1.0, y), 0.0);
    let all: f32 = 1.0 - lost * lost;
    let square: f32 = mean * mean;
    let grazing: f32 = all * (square * square * mean);
    return vec2f(all - grazing, grazing);
}
