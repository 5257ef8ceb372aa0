/* What a fit found, in a C program: reads a baked cube and prints the light of diffuse and rim.
 *
 *     skinfit export run/params.toml --to c -o skin.h
 *     skinfit bake run/scene.toml --params run/params.toml -o baked --cubes dds
 *     cc -std=c99 -I . main.c -lm -o engine_c
 *     echo "0 0 1 0.9 0.2" | ./engine_c baked/irradiance.dds
 *
 * A line of standard input is a fragment: its unit normal in the world (glTF's axes), the open share of its hemisphere,
 * and 1 - |N.V|. A line of standard output is its radiance for a white albedo, red, green and blue:
 *
 *     E_d(n) (1 - occlusion (1 - open)) (base_weight + rim_weight (1 - |N.V|)^rim_exponent)
 *
 * (docs/model.md, section 3.) Both kinds of file that skinfit writes are read, KTX2 and DDS. */

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "skin.h"

/* Faces +X -X +Y -Y +Z -Z, each row by row from its top; RGBA halves. */
typedef struct {
    long size;
    const unsigned char *texels;
} Cube;

static uint32_t word(const unsigned char *at) {
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

/* IEEE 754 binary16. */
static double half(const unsigned char *at) {
    unsigned bits = at[0] | (unsigned)at[1] << 8;
    int exponent = bits >> 10 & 31;
    double fraction = bits & 1023;
    double size = exponent == 0 ? ldexp(fraction, -24) : ldexp(1024.0 + fraction, exponent - 25);
    return bits >> 15 ? -size : size;
}

/* The cube of a file's bytes; a size of 0 where they are none that skinfit writes. */
static Cube cube_of(const unsigned char *bytes, size_t length) {
    static const unsigned char ktx2[12] = {0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};
    Cube cube = {0, NULL};
    size_t at = 0;
    /* DXGI_FORMAT_R16G16B16A16_FLOAT is 10, VK_FORMAT_R16G16B16A16_SFLOAT 97. */
    if (length > 148 && !memcmp(bytes, "DDS ", 4) && !memcmp(bytes + 84, "DX10", 4) && word(bytes + 128) == 10) {
        cube.size = (long)word(bytes + 16);
        at = 148;
    } else if (length > 104 && !memcmp(bytes, ktx2, 12) && word(bytes + 12) == 97 && word(bytes + 36) == 6) {
        cube.size = (long)word(bytes + 20);
        at = word(bytes + 80);
    }
    /* Of an array the first cube is read. */
    if (cube.size < 1 || cube.size > 16384 || at > length || length - at < 48 * (size_t)cube.size * (size_t)cube.size) {
        cube.size = 0;
    }
    cube.texels = bytes + at;
    return cube;
}

/* The face that a direction meets, and where on it, s and t in [-1, 1], t downwards (Vulkan 1.3, "Cube Map Face Selection"). */
static int face_of(const double d[3], double *s, double *t) {
    double x = fabs(d[0]), y = fabs(d[1]), z = fabs(d[2]);
    if (x >= y && x >= z) {
        *s = (d[0] >= 0 ? -d[2] : d[2]) / x;
        *t = -d[1] / x;
        return d[0] >= 0 ? 0 : 1;
    }
    if (y >= z) {
        *s = d[0] / y;
        *t = (d[1] >= 0 ? d[2] : -d[2]) / y;
        return d[1] >= 0 ? 2 : 3;
    }
    *s = (d[2] >= 0 ? d[0] : -d[0]) / z;
    *t = -d[1] / z;
    return d[2] >= 0 ? 4 : 5;
}

/* The direction of a place on a face. */
static void direction_of(int face, double s, double t, double d[3]) {
    double all[6][3] = {{1, -t, -s}, {-1, -t, s}, {s, 1, t}, {s, -1, -t}, {s, -t, 1}, {-s, -t, -1}};
    memcpy(d, all[face], sizeof all[face]);
}

static long clamped(double u, long size) {
    long at = (long)floor((u + 1) / 2 * (double)size);
    return at < 0 ? 0 : at >= size ? size - 1 : at;
}

/* A texel of a face, or its neighbour's where it lies one beyond the edge. */
static void texel(const Cube *cube, int face, long column, long row, double rgb[3]) {
    if (column < 0 || row < 0 || column >= cube->size || row >= cube->size) {
        double d[3], s, t, size = (double)cube->size;
        direction_of(face, (2.0 * (double)column + 1) / size - 1, (2.0 * (double)row + 1) / size - 1, d);
        face = face_of(d, &s, &t);
        column = clamped(s, cube->size);
        row = clamped(t, cube->size);
    }
    const unsigned char *at = cube->texels + 8 * ((face * cube->size + row) * cube->size + column);
    for (int c = 0; c < 3; c++) {
        rgb[c] = half(at + 2 * c);
    }
}

/* The seamless bilinear lookup that graphics hardware makes of a cube (Vulkan 1.3, "Cube Map Edge Handling"): at a corner,
 * where three texels meet, their mean stands for the fourth. */
static void look_up(const Cube *cube, const double d[3], double rgb[3]) {
    double s, t, four[4][3];
    int face = face_of(d, &s, &t), beyond_corner = -1;
    double x = (s + 1) / 2 * (double)cube->size - 0.5, y = (t + 1) / 2 * (double)cube->size - 0.5;
    long left = (long)floor(x), top = (long)floor(y);
    for (int i = 0; i < 4; i++) {
        long column = left + i % 2, row = top + i / 2;
        if ((column < 0 || column >= cube->size) && (row < 0 || row >= cube->size)) {
            beyond_corner = i;
        } else {
            texel(cube, face, column, row, four[i]);
        }
    }
    for (int c = 0; c < 3; c++) {
        if (beyond_corner >= 0) {
            double sum = 0;
            for (int i = 0; i < 4; i++) {
                sum += i == beyond_corner ? 0 : four[i][c];
            }
            four[beyond_corner][c] = sum / 3;
        }
        double across = x - (double)left, down = y - (double)top;
        double upper = four[0][c] + across * (four[1][c] - four[0][c]);
        double lower = four[2][c] + across * (four[3][c] - four[2][c]);
        rgb[c] = upper + down * (lower - upper);
    }
}

/* The whole of a file; NULL where it cannot be read. */
static unsigned char *read_file(const char *name, size_t *length) {
    unsigned char *bytes = NULL;
    FILE *file = fopen(name, "rb");
    long end = file && !fseek(file, 0, SEEK_END) ? ftell(file) : -1;
    if (end > 0 && !fseek(file, 0, SEEK_SET) && (bytes = malloc((size_t)end))) {
        *length = fread(bytes, 1, (size_t)end, file);
    }
    if (file) {
        fclose(file);
    }
    return bytes;
}

int main(int count, char **arguments) {
    size_t length = 0;
    unsigned char *bytes = count == 2 ? read_file(arguments[1], &length) : NULL;
    Cube cube = {0, NULL};
    if (bytes) {
        cube = cube_of(bytes, length);
    }
    if (cube.size == 0) {
        fprintf(stderr, "engine_c: name one cube that `skinfit bake --cubes ktx2,dds` wrote.\n");
        free(bytes);
        return 2;
    }
    double n[3], open, silhouette, light[3];
    while (scanf("%lf %lf %lf %lf %lf", &n[0], &n[1], &n[2], &open, &silhouette) == 5) {
        look_up(&cube, n, light);
        double occ = 1 - skinfit_occlusion * (1 - open);
        double rim = pow(silhouette, skinfit_rim_exponent);
        for (int c = 0; c < 3; c++) {
            double weight = skinfit_base_weight[c] + skinfit_rim_weight[c] * rim;
            printf("%.9g%c", light[c] * occ * weight, c < 2 ? ' ' : '\n');
        }
    }
    free(bytes);
    return 0;
}
