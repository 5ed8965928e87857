/* The numeric kernels, each beside a plain loop over poses, under every instruction set that the machine has; the only
 * test that links without CHOLMOD and BLAS, so that it also runs where it was compiled for another processor
 * (make check-aarch64).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/numbers_kernel.h"
#include "kernels.h"
#include "method/pairs/transfer_kernel.h"
#include "method/patches/segment_kernel.h"
#include "method/rig/map_kernel.h"
#include "method/rig/play_kernel.h"
#include "method/rig/rig_kernel.h"
#include "method/vectors/deform_kernel.h"
#include "method/vectors/guess.h"
#include "method/vectors/planar_kernel.h"
#include "model/measures_kernel.h"
#include "numeric/polar.h"
#include "numeric/solve_kernel.h"
#include "test.h"

/* A number in (-1, 1) that depends on i alone, so to the last bit: it is not folded in one place and called in another. */
__attribute__((noinline, noclone)) static double wave(size_t i)
{
    return sin(1.7 * (double)i + 0.3 * (double)(i % 13));
}

static void choose_by_name(void)
{
    vg_err e;
    CHECK(vg_isa_choose("mmx", &e) == VG_EARG);
    CHECK_TEXT(e.message, "an instruction set is avx512, avx2, sse2 or neon, not 'mmx'");
#if defined(__x86_64__)
    CHECK(vg_isa_choose("neon", &e) == VG_EARG);
    CHECK(!strncmp(e.message, "this machine has no neon: its widest instruction set is ", 56));
#endif
    CHECK(vg_isa_choose(NULL, &e) == VG_OK);
    size_t n = 0;
    while (vg_isa_at(n)) n++;
    CHECK(n >= 1);
    CHECK_TEXT(vg_isa(), vg_isa_at(n - 1));
}

/* ---- numbers ---- */

static void check_numbers(void)
{
    enum { MOST = 75 };
    double x[MOST] = {0}, y[MOST];
    for (size_t n = 0; n <= MOST; n++) {
        for (size_t i = 0; i < n; i++) x[i] = i % 3 ? wave(i) : -0.0;
        CHECK(vgi_numbers_kernel_now()->finite(x, n));
        vgi_plain_zeros(y, x, n);
        for (size_t i = 0; i < n; i++) CHECK(y[i] == x[i] && !(i % 3 == 0 && signbit(y[i])));
        for (size_t i = 0; i < n; i++) {
            double kept = x[i];
            x[i] = i % 2 ? NAN : -INFINITY;
            CHECK(!vgi_numbers_kernel_now()->finite(x, n));
            x[i] = kept;
        }
    }
}

static void check_singles(void)
{
    enum { MOST = 45 };
    double x[MOST];
    float y[MOST + 1];
    for (size_t n = 0; n <= MOST; n++) {
        for (size_t i = 0; i < MOST; i++) x[i] = wave(i), y[i] = 77;
        y[MOST] = 77;
        CHECK(vgi_to_single(y, x, n));
        for (size_t i = 0; i <= MOST; i++) CHECK(y[i] == (i < n ? (float)x[i] : 77));
        for (size_t i = 0; i < n; i++) {
            double kept = x[i];
            x[i] = i % 2 ? NAN : -1e39; /* too large for binary32 */
            CHECK(!vgi_to_single(y, x, n));
            x[i] = kept;
        }
    }
}

static void numbers_are_scanned(void)
{
    under_each(check_numbers);
    under_each(check_singles);
}

/* ---- solve ---- */

enum { N = 11 };

/* A factor of two supernodes, 5 columns over rows 0-4, 6, 7, 9 and 6 columns over rows 5-10, as a dense L. */
static void make_factor(const double **block, double *values, double dense[N][N], vgi_factor *f)
{
    static const int super[3] = {0, 5, N}, pi[3] = {0, 8, 14}, px[3] = {0, 40, 76};
    static const int rows[14] = {0, 1, 2, 3, 4, 6, 7, 9, 5, 6, 7, 8, 9, 10};
    memset(dense, 0, N * N * sizeof **dense);
    for (int s = 0; s < 2; s++) {
        int columns = super[s + 1] - super[s], nrows = pi[s + 1] - pi[s];
        for (int k = 0; k < columns; k++)
            for (int i = 0; i < nrows; i++) {
                double *to = &values[px[s] + k * nrows + i];
                *to = i == k ? 3 + 0.1 * i : i > k ? wave((size_t)(i * 17 + k + s)) : NAN; /* above: not looked at */
                if (i >= k) dense[rows[pi[s] + i]][super[s] + k] = *to;
            }
    }
    block[0] = values, block[1] = values + px[1];
    *f = (vgi_factor){N, 2, super, pi, rows, block};
}

/* b = L L' x of known x gives x back, for eight poses and for one with the same bits. */
static void check_solve(void)
{
    double values[76], L[N][N], one[N][4] = {{0}};
    const double *block[2];
    vgi_factor f;
    make_factor(block, values, L, &f);
    vgi_row x[N];
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < VGI_LANES; k++) {
            double y[N] = {0};
            for (size_t j = 0; j < N; j++)
                for (size_t i = 0; i < N; i++) y[j] += L[i][j] * wave(100 * i + 10 * c + k);
            for (size_t i = 0; i < N; i++) {
                x[i].xyz[c][k] = 0;
                for (size_t j = 0; j < N; j++) x[i].xyz[c][k] += L[i][j] * y[j];
            }
        }
    for (size_t i = 0; i < N; i++)
        for (size_t c = 0; c < 3; c++) one[i][c] = x[i].xyz[c][5];
    vgi_factor_solve(&f, x);
    vgi_factor_solve_one(&f, *one);
    for (size_t i = 0; i < N; i++)
        for (size_t c = 0; c < 3; c++) {
            for (size_t k = 0; k < VGI_LANES; k++) CHECK_NEAR(x[i].xyz[c][k], wave(100 * i + 10 * c + k), 1e-13);
            CHECK(one[i][c] == x[i].xyz[c][5]);
        }
}

static void check_rows(void)
{
    enum { NV = 21, ROWS = 9 };
    static double pose[VGI_LANES][3 * NV];
    double *to[VGI_LANES];
    const double *from[VGI_LANES];
    uint32_t row[NV];
    vgi_row x[ROWS];
    for (size_t v = 0; v < NV; v++) row[v] = v % 2 ? (uint32_t)(v / 2) : UINT32_MAX; /* row 9 is beyond */
    for (size_t lanes = 1; lanes <= VGI_LANES; lanes++) {
        for (size_t k = 0; k < VGI_LANES; k++) {
            from[k] = to[k] = pose[k];
            for (size_t i = 0; i < 3 * NV; i++) pose[k][i] = wave(i + 1000 * k);
        }
        memset(x, 0, sizeof x);
        vgi_load_rows(x, row, NV, ROWS, from);
        for (size_t r = 0; r < ROWS; r++)
            for (size_t c = 0; c < 3; c++)
                for (size_t k = 0; k < VGI_LANES; k++) CHECK(x[r].xyz[c][k] == pose[k][3 * (2 * r + 1) + c]);
        vgi_add_rows(x, row, NV, ROWS, to, lanes);
        for (size_t k = 0; k < VGI_LANES; k++)
            for (size_t i = 0; i < 3 * NV; i++) {
                bool added = k < lanes && i / 3 % 2 && i / 3 / 2 < ROWS;
                CHECK(pose[k][i] == (added ? 2 : 1) * wave(i + 1000 * k));
            }
    }
}

static void factors_are_solved(void)
{
    under_each(check_solve);
}

static void rows_come_and_go(void)
{
    under_each(check_rows);
}

/* ---- faces ---- */

enum { CORNERS = 3 + 4 + 5 + 3, FACES = 4, POINTS = 9 };
static const uint32_t start[FACES + 1] = {0, 3, 7, 12, 15};
static const uint32_t vert[CORNERS] = {0, 1, 2, 2, 1, 3, 4, 4, 3, 5, 6, 7, 8, 7, 6};

static void make_poses(double pose[VGI_LANES][3 * POINTS], const double *poses[VGI_LANES])
{
    for (size_t k = 0; k < VGI_LANES; k++) {
        poses[k] = pose[k];
        for (size_t i = 0; i < 3 * POINTS; i++) pose[k][i] = wave(7 * i + 5 * k) + 3 * wave(i / 3);
    }
}

/* Vectors of a face: corners less their mean. */
static void vectors_of(const double *pose, size_t f, double *w)
{
    size_t r = start[f + 1] - start[f];
    for (size_t c = 0; c < 3; c++) {
        double mean = 0;
        for (size_t i = 0; i < r; i++) mean += pose[3 * (size_t)vert[start[f] + i] + c] / (double)r;
        for (size_t i = 0; i < r; i++) w[3 * i + c] = pose[3 * (size_t)vert[start[f] + i] + c] - mean;
    }
}

static void unit_normal(const double *w, size_t r, double n[3])
{
    n[0] = n[1] = n[2] = 0;
    for (size_t i = 0; i < r; i++) {
        const double *a = w + 3 * i, *b = w + 3 * ((i + 1) % r);
        n[0] += a[1] * b[2] - a[2] * b[1], n[1] += a[2] * b[0] - a[0] * b[2], n[2] += a[0] * b[1] - a[1] * b[0];
    }
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int c = 0; c < 3; c++) n[c] /= length;
}

static void count_bad(void *context, size_t face, unsigned lanes)
{
    unsigned *bad = context;
    bad[face] |= lanes;
}

/* |d| (k_u u + k_b b + k_n n), u along the vector, n the face's normal made upright to it, b = n x u */
static void expected_vector(const double *d, const double n[3], const double k[3], double to[3])
{
    double u[3], m[3], size = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), along = 0, length = 0;
    for (int c = 0; c < 3; c++) u[c] = d[c] / size, along += u[c] * n[c];
    for (int c = 0; c < 3; c++) m[c] = n[c] - along * u[c], length += m[c] * m[c];
    for (int c = 0; c < 3; c++) m[c] /= sqrt(length);
    const double b[3] = {m[1] * u[2] - m[2] * u[1], m[2] * u[0] - m[0] * u[2], m[0] * u[1] - m[1] * u[0]};
    for (int c = 0; c < 3; c++) to[c] = size * (k[0] * u[c] + k[1] * b[c] + k[2] * m[c]);
}

static void check_deform(void)
{
    double pose[VGI_LANES][3 * POINTS], coordinates[3 * CORNERS], w[15], n[3], expected[3];
    static double result[VGI_LANES][3 * CORNERS];
    double *out[VGI_LANES];
    const double *poses[VGI_LANES];
    const unsigned char skip[FACES] = {0};
    vgi_lane_point room[2 * 6];
    make_poses(pose, poses);
    memset(pose[3], 0, sizeof pose[3]); /* degenerate */
    for (size_t i = 0; i < 3 * CORNERS; i++) coordinates[i] = wave(i);
    for (size_t lanes = 1; lanes <= VGI_LANES; lanes++) {
        unsigned bad[FACES] = {0};
        for (size_t k = 0; k < VGI_LANES; k++) {
            out[k] = result[k];
            for (size_t i = 0; i < 3 * CORNERS; i++) result[k][i] = 77;
        }
        const vgi_transfer t = {.start = start, .vert = vert, .poses = poses, .vertices = true, .method = VGI_POSE,
                                .coordinates = coordinates, .shortest2 = 1e-20, .skip = skip, .out = out,
                                .lanes = lanes, .bad = count_bad, .context = bad};
        vgi_transfer_faces(&t, 0, FACES, room, 5);
        for (size_t f = 0; f < FACES; f++) CHECK(bad[f] == (lanes > 3 ? 8u : 0u));
        for (size_t k = 0; k < VGI_LANES; k++)
            for (size_t f = 0; f < FACES && k != 3; f++) {
                vectors_of(pose[k], f, w);
                unit_normal(w, start[f + 1] - start[f], n);
                for (size_t i = start[f]; i < start[f + 1]; i++) {
                    expected_vector(w + 3 * (i - start[f]), n, coordinates + 3 * i, expected);
                    for (size_t c = 0; c < 3; c++)
                        CHECK_NEAR(result[k][3 * i + c], k < lanes ? expected[c] : 77, 1e-12);
                }
            }
    }
}

/* D from definition: sum d_k (p_k . b) + n (q . b) + rho d */
static void check_gradient(void)
{
    double pose[VGI_LANES][3 * POINTS], w[15], n[3];
    static double result[VGI_LANES][3 * CORNERS];
    double *out[VGI_LANES];
    const double *poses[VGI_LANES];
    const unsigned char skip[FACES] = {0};
    vgi_gradient gradient[CORNERS];
    vgi_gradient_face face[FACES];
    unsigned bad[FACES] = {0};
    vgi_lane_point room[2 * 6];
    make_poses(pose, poses);
    for (size_t k = 0; k < VGI_LANES; k++) out[k] = result[k];
    for (size_t i = 0; i < CORNERS; i++)
        for (size_t c = 0; c < 3; c++) gradient[i].p[c] = wave(3 * i + c), gradient[i].b[c] = wave(90 + 3 * i + c);
    for (size_t f = 0; f < FACES; f++)
        face[f] = (vgi_gradient_face){{wave(f), wave(f + 20), wave(f + 40)}, 0.5 + 0.1 * (double)f};
    const vgi_transfer t = {.start = start, .vert = vert, .poses = poses, .vertices = true, .method = VGI_GRADIENT,
                            .gradient = gradient, .gradient_face = face, .shortest2 = 1e-20, .skip = skip,
                            .out = out, .lanes = VGI_LANES, .bad = count_bad, .context = bad};
    vgi_transfer_faces(&t, 0, FACES, room, 5);
    for (size_t k = 0; k < VGI_LANES; k++)
        for (size_t f = 0; f < FACES; f++) {
            size_t r = start[f + 1] - start[f];
            vectors_of(pose[k], f, w);
            unit_normal(w, r, n);
            for (size_t i = 0; i < r; i++)
                for (size_t c = 0; c < 3; c++) {
                    const double *b = gradient[start[f] + i].b, *q = face[f].q;
                    double sum = n[c] * (q[0] * b[0] + q[1] * b[1] + q[2] * b[2]) + face[f].rho * w[3 * i + c];
                    for (size_t j = 0; j < r; j++) {
                        const double *p = gradient[start[f] + j].p;
                        sum += w[3 * j + c] * (p[0] * b[0] + p[1] * b[1] + p[2] * b[2]);
                    }
                    CHECK_NEAR(result[k][3 * (start[f] + i) + c], sum, 1e-12);
                }
        }
    for (size_t f = 0; f < FACES; f++) CHECK(bad[f] == 0);
}

static void vectors_are_deformed(void)
{
    under_each(check_deform);
    under_each(check_gradient);
}

/* The walk adds up vectors of a pose and finds the pose again, less its held vertex; nothing is missed. Moving one
 * vector by d pulls its corner by d less the mean, and the others by minus the mean. */
static void check_guess(void)
{
    static const vgi_step walk[POINTS - 1] = {{1, 0}, {2, 0}, {5, 4}, {6, 3}, {9, 8}, {10, 7}, {11, 7}, {12, 13}};
    double pose[VGI_LANES][3 * POINTS], w[3 * CORNERS], x[3 * POINTS], rhs[3 * POINTS];
    const double *poses[VGI_LANES];
    unsigned char in_face[POINTS];
    memset(in_face, 1, sizeof in_face);
    make_poses(pose, poses);
    vg_graph g = {.faces.nv = POINTS, .faces.nf = FACES, .max_corners = 5};
    uint32_t starts[FACES + 1], verts[CORNERS];
    memcpy(starts, start, sizeof start), memcpy(verts, vert, sizeof vert);
    g.faces.start = starts, g.faces.vert = verts;
    vgi_metric metric = {0};
    vgi_point space[POINTS + 5];
    const vgi_guesser s = {.g = &g, .metric = &metric, .walk = walk, .nsteps = POINTS - 1, .pinned = 0};
    for (size_t f = 0; f < FACES; f++) vectors_of(pose[0], f, w + 3 * start[f]);
    vgi_guess(&s, w, NULL, x, rhs, space);
    for (size_t i = 0; i < 3 * POINTS; i++) {
        CHECK_NEAR(x[i], pose[0][i] - pose[0][i % 3], 1e-14);
        CHECK_NEAR(rhs[i], 0, 1e-14);
    }
    w[3 * 9 + 1] += 1; /* y of vertex 5 in the pentagon, from which its walk starts: 5 moves, and so nothing is missed */
    w[3 * 6 + 2] += 1; /* z of vertex 4 in the quad: 4 moves by 1, and with it all that is behind */
    vgi_guess(&s, w, NULL, x, rhs, space);
    CHECK_NEAR(x[3 * 5 + 1], pose[0][3 * 5 + 1] - pose[0][1] + 1, 1e-14);
    w[3 * 14] += 3; /* x of vertex 6 in the last triangle, which its walk does not take */
    vgi_guess(&s, w, NULL, x, rhs, space);
    CHECK_NEAR(rhs[3 * 6], 2, 1e-14);
    CHECK_NEAR(rhs[3 * 7], -1, 1e-14);
    CHECK_NEAR(rhs[3 * 8], -1, 1e-14);
}

static void poses_are_guessed(void)
{
    under_each(check_guess);
}

/* ---- rotations and maps ---- */

static void rotation_of(double angle, double r[9])
{
    double c = cos(angle), s = sin(angle), x = 0.6, z = 0.8; /* about (0.6, 0, 0.8) */
    const double m[9] = {c + x * x * (1 - c), -z * s, x * z * (1 - c), z * s, c, -x * s, x * z * (1 - c), x * s,
                         c + z * z * (1 - c)};
    memcpy(r, m, sizeof m);
}

/* R S for symmetric positive S has the rotation R. */
static void check_polar(void)
{
    vgi_map a, r;
    static const double stretch[9] = {2, 0.3, -0.2, 0.3, 1, 0.1, -0.2, 0.1, 0.4};
    double turn[9];
    for (int k = 0; k < VGI_LANES; k++) {
        rotation_of(0.4 * k - 1, turn);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                a.m[3 * i + j][k] = 0;
                for (int l = 0; l < 3; l++) a.m[3 * i + j][k] += turn[3 * i + l] * stretch[3 * l + j] * (k + 1);
            }
    }
    for (int i = 0; i < 9; i++) a.m[i][5] = 0; /* no rotation is nearest: the identity */
    vgi_transfer_kernel_now()->polar(&a, &r);
    for (int k = 0; k < VGI_LANES; k++) {
        rotation_of(k == 5 ? 0 : 0.4 * k - 1, turn);
        for (int i = 0; i < 9; i++) CHECK_NEAR(r.m[i][k], turn[i], 1e-14);
    }
}

/* Faces that turn as a whole. */
static void check_turns(void)
{
    double pose[VGI_LANES][3 * POINTS], reference[3 * POINTS], turn[9];
    const double *poses[VGI_LANES];
    vg_err e;
    vgi_turns t;
    for (size_t i = 0; i < 3 * POINTS; i++) reference[i] = wave(7 * i);
    for (size_t k = 0; k < VGI_LANES; k++) {
        poses[k] = pose[k];
        rotation_of(0.4 * (double)k - 1, turn);
        for (size_t v = 0; v < POINTS; v++)
            for (size_t i = 0; i < 3; i++) {
                pose[k][3 * v + i] = (double)k;
                for (size_t j = 0; j < 3; j++) pose[k][3 * v + i] += turn[3 * i + j] * reference[3 * v + j];
            }
    }
    CHECK(vgi_turns_make(&t, FACES, start, vert, reference, &e) == VG_OK);
    for (size_t f = 0; f < FACES; f++) {
        vgi_lanes r[9];
        vgi_turns_measure(&t, f, poses, r);
        for (size_t k = 0; k < VGI_LANES; k++) {
            rotation_of(0.4 * (double)k - 1, turn);
            for (int i = 0; i < 9; i++) CHECK_NEAR(r[i][k], turn[i], 1e-10);
        }
    }
    vgi_turns_clear(&t);
}

/* The mean of maps leaves out lanes that have none; vectors follow it. */
static void check_follow(void)
{
    vgi_map maps[2], sum;
    vgi_lanes weight = {0};
    const unsigned char bad[2] = {0x81, 0x80};
    const uint32_t source[2] = {0, 1};
    const double share[2] = {0.25, 0.5}, v[3] = {1, -2, 0.5};
    double result[VGI_LANES][6], *out[VGI_LANES];
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < VGI_LANES; k++)
            for (int m = 0; m < 2; m++) maps[m].m[i][k] = wave((size_t)(i + 9 * k + 100 * m));
    memset(&sum, 0, sizeof sum);
    const vgi_drivers d = {maps, bad, source, share};
    vgi_transfer_kernel_now()->add(&d, 0, 2, &sum, weight);
    vgi_transfer_kernel_now()->finish(&sum, weight);
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < VGI_LANES; k++) {
            double a = maps[0].m[i][k], b = maps[1].m[i][k];
            CHECK_NEAR(sum.m[i][k], k == 0 ? b : k == 7 ? i % 4 == 0 : (0.25 * a + 0.5 * b) / 0.75, 1e-15);
        }
    for (size_t lanes = 1; lanes <= VGI_LANES; lanes++) {
        for (size_t k = 0; k < VGI_LANES; k++) {
            out[k] = result[k];
            for (size_t i = 0; i < 6; i++) result[k][i] = 77;
        }
        vgi_transfer_kernel_now()->follow(&sum, VGI_FOLLOW_GRADIENT, v, 1, out, 3, lanes);
        for (size_t k = 0; k < VGI_LANES; k++)
            for (size_t i = 0; i < 6; i++) {
                double x = 77;
                if (k < lanes && i >= 3) {
                    x = 0;
                    for (size_t j = 0; j < 3; j++) x += sum.m[3 * (i - 3) + j][k] * v[j];
                }
                CHECK_NEAR(result[k][i], x, 1e-14);
            }
    }
}

static void rotations_are_found(void)
{
    under_each(check_polar);
    under_each(check_turns);
}

static void maps_are_followed(void)
{
    under_each(check_follow);
}

/* ---- planarity ---- */

/* y += P p and p.P p from definition: with h_c = m . p_c, each corner adds (h_c - mean) m. */
static void check_planar(void)
{
    static vgi_row normals[2], p[POINTS], y[POINTS], s[POINTS];
    static const uint32_t faces[3] = {3, 7, 12};
    vgi_lanes h[8], pPp, expected = {0}, ab, beta;
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < VGI_LANES; k++) {
            for (size_t i = 0; i < 2; i++) normals[i].xyz[c][k] = wave(i + 2 * c + 6 * k);
            for (size_t i = 0; i < POINTS; i++)
                p[i].xyz[c][k] = wave(i + 9 * c + 30 * k), y[i].xyz[c][k] = s[i].xyz[c][k] = wave(i + c + k);
        }
    const vgi_planar_kernel *kernel = vgi_planar_kernel_now();
    const vgi_planar_faces f = {2, faces, vert};
    kernel->product(&f, normals, p, y, h, pPp);
    for (size_t k = 0; k < VGI_LANES; k++) {
        double sum[POINTS][3] = {{0}};
        for (size_t i = 0; i < 2; i++) {
            double mean = 0, at[5];
            size_t r = faces[i + 1] - faces[i];
            for (size_t j = 0; j < r; j++) {
                const vgi_row *v = &p[vert[faces[i] + j]];
                at[j] = 0;
                for (size_t c = 0; c < 3; c++) at[j] += normals[i].xyz[c][k] * v->xyz[c][k];
                mean += at[j] / (double)r;
            }
            for (size_t j = 0; j < r; j++) {
                expected[k] += (at[j] - mean) * (at[j] - mean);
                for (size_t c = 0; c < 3; c++)
                    sum[vert[faces[i] + j]][c] += (at[j] - mean) * normals[i].xyz[c][k];
            }
        }
        CHECK_NEAR(pPp[k], expected[k], 1e-13);
        for (size_t v = 0; v < POINTS; v++)
            for (size_t c = 0; c < 3; c++) CHECK_NEAR(y[v].xyz[c][k], s[v].xyz[c][k] + sum[v][c], 1e-14);
        beta[k] = wave(k);
    }
    kernel->dot(POINTS, p, y, ab);
    for (size_t k = 0; k < VGI_LANES; k++) {
        double sum = 0;
        for (size_t i = 0; i < 3 * POINTS; i++) sum += p[i / 3].xyz[i % 3][k] * y[i / 3].xyz[i % 3][k];
        CHECK_NEAR(ab[k], sum, 1e-13);
    }
    kernel->scale(POINTS, beta, p, s);
    kernel->largest(POINTS, p, ab);
    for (size_t k = 0; k < VGI_LANES; k++) {
        double most = 0;
        for (size_t i = 0; i < 3 * POINTS; i++) {
            CHECK(s[i / 3].xyz[i % 3][k] == beta[k] * p[i / 3].xyz[i % 3][k]);
            most = fmax(most, fabs(p[i / 3].xyz[i % 3][k]));
        }
        CHECK(ab[k] == most);
    }
}

/* turn: p := z + beta p, s := r + beta s; advance: x += alpha p, r -= alpha s + gamma y, z := r, y := 0 */
static void check_descent(void)
{
    static vgi_row z[POINTS], r[POINTS], p[POINTS], s[POINTS], x[POINTS], y[POINTS], z0[POINTS], r0[POINTS],
        p0[POINTS], s0[POINTS], x0[POINTS], y0[POINTS];
    double *now[6] = {(double *)z, (double *)r, (double *)p, (double *)s, (double *)x, (double *)y};
    double *old[6] = {(double *)z0, (double *)r0, (double *)p0, (double *)s0, (double *)x0, (double *)y0};
    vgi_lanes beta, alpha, gamma, ps, sum = {0};
    for (size_t a = 0; a < 6; a++)
        for (size_t i = 0; i < POINTS * 3 * VGI_LANES; i++)
            now[a][i] = old[a][i] = wave(i + 1000 * a);
    for (size_t k = 0; k < VGI_LANES; k++) beta[k] = wave(k), alpha[k] = wave(k + 10), gamma[k] = wave(k + 20);
    vgi_planar_kernel_now()->turn(POINTS, z, r, beta, p, s, ps);
    vgi_planar_kernel_now()->advance(POINTS, alpha, gamma, p, s, y, x, r, z);
    for (size_t i = 0; i < POINTS * 3 * VGI_LANES; i++) {
        size_t k = i % VGI_LANES;
        double pi = old[0][i] + beta[k] * old[2][i], si = old[1][i] + beta[k] * old[3][i];
        sum[k] += pi * si;
        CHECK_NEAR(now[2][i], pi, 1e-15);
        CHECK_NEAR(now[3][i], si, 1e-15);
        CHECK_NEAR(now[4][i], old[4][i] + alpha[k] * pi, 1e-15);
        CHECK_NEAR(now[1][i], old[1][i] - alpha[k] * si - gamma[k] * old[5][i], 1e-15);
        CHECK(now[0][i] == now[1][i] && now[5][i] == 0);
    }
    for (size_t k = 0; k < VGI_LANES; k++) CHECK_NEAR(ps[k], sum[k], 1e-13);
}

static void planes_are_sought(void)
{
    under_each(check_planar);
    under_each(check_descent);
}

/* ---- measures ---- */

/* Squares, all but the first of which are larger or turned in the result: 11 faces, so that the last eight are not all
 * there. */
static void check_measures(void)
{
    enum { SQUARES = 11 };
    double truth[12 * SQUARES], result[12 * SQUARES];
    uint32_t corners[2 * 8 * 4];
    double area = 0, orientation = 0;
    for (size_t f = 0; f < 16; f++)
        for (size_t i = 0; i < 4; i++)
            corners[f / 8 * 32 + i * 8 + f % 8] = (uint32_t)(4 * (f < SQUARES ? f : SQUARES - 1) + i);
    for (size_t f = 0; f < SQUARES; f++) {
        double size = 1 + 0.05 * (double)f, angle = 0.1 * (double)f;
        area += (size * size - 1) / SQUARES, orientation += (1 - cos(angle)) / SQUARES;
        for (size_t i = 0; i < 4; i++) {
            double x = i == 1 || i == 2, y = i >= 2, *a = truth + 12 * f + 3 * i, *b = result + 12 * f + 3 * i;
            a[0] = x, a[1] = y, a[2] = (double)f;
            b[0] = size * x, b[1] = size * cos(angle) * y, b[2] = size * sin(angle) * y;
        }
    }
    const double *const poses[2] = {truth, result};
    const vgi_face_class c = {4, SQUARES, corners};
    vgi_face_sums sums;
    memset(&sums, 0, sizeof sums);
    vgi_measures_kernel_now()->faces(&c, 2, poses, &sums);
    CHECK(sums.area.n == SQUARES && sums.orientation.n == SQUARES && sums.planarity[1].n == SQUARES);
    CHECK_NEAR(sums.area.mean, area, 1e-14);
    CHECK_NEAR(sums.area.max, 1.5 * 1.5 - 1, 1e-14);
    CHECK_NEAR(sums.orientation.mean, orientation, 1e-14);
    CHECK_NEAR(sums.planarity[1].max, 0, 1e-15);
    CHECK(sums.planarity_histogram[0][0] == SQUARES && sums.planarity_histogram[1][0] == SQUARES);
}

static void faces_are_measured(void)
{
    under_each(check_measures);
}

/* ---- features ---- */

static void check_features(void)
{
    enum { MOST = 80 };
    float a[MOST], b[MOST], sign[72], feature[32] = {0};
    double to[MOST] = {0}, from[MOST] = {0};
    uint32_t at[72];
    vgi_lanes rotation[9];
    for (size_t i = 0; i < MOST; i++) a[i] = (float)wave(i), b[i] = (float)wave(i + 50);
    for (size_t n = 0; n <= MOST; n += 16) {
        double sum = 0;
        for (size_t i = 0; i < n; i++) sum += (double)a[i] * (double)b[i];
        CHECK_NEAR((double)vgi_segment_kernel_now()->inner(a, b, n), sum, 1e-5);
    }
    vgi_segment_kernel_now()->move(a, 77, to, from);
    vgi_segment_kernel_now()->move(b, 77, to, NULL);
    for (size_t i = 0; i < MOST; i++) {
        CHECK(to[i] == (i < 77 ? (double)a[i] + (double)b[i] : 0));
        CHECK(from[i] == (i < 77 ? -(double)a[i] : 0));
    }
    for (size_t i = 0; i < 72; i++) {
        at[i] = (uint32_t)(i % 31), sign[i] = i % 3 ? 1 : -1;
        rotation[i % 9][i / 9] = 0.25 * (double)i; /* exact in binary32 */
    }
    vgi_segment_kernel_now()->add(rotation, 5, at, sign, feature);
    double expected[32] = {0};
    for (size_t i = 0; i < 45; i++)
        expected[i % 31] += (double)sign[i] * (0.25 * (double)i - (i % 9 % 4 == 0));
    for (size_t i = 0; i < 32; i++) CHECK((double)feature[i] == expected[i]);
}

static void features_are_summed(void)
{
    under_each(check_features);
}

/* ---- fits of maps ---- */

enum { MAP_POSES = 5, MAP_CORNERS = 4, MAP_PATCHES = 2, MAP_VERTICES = 6 };

/* Sum over poses and rows of a[q][k] d[q] */
static double back_of(const double a[9][VGI_LANES], const double d[][VGI_LANES], size_t k)
{
    double sum = 0;
    for (size_t i = 0; i < MAP_POSES; i++)
        for (size_t q = 0; q < 3; q++) sum += a[3 * q + k][i] * d[q][i];
    return sum;
}

/* Sums of what poses add, by the formula; lanes beyond the poses carry no motion and count for nothing. */
static void check_map_sums(void)
{
    static const uint32_t corner[MAP_CORNERS] = {4, 0, 3, 1}, near[2] = {1, 0};
    vgi_map_motion m[MAP_PATCHES] = {0};
    vgi_lanes turn[9];
    double x[VGI_LANES][3 * MAP_VERTICES], d[3][VGI_LANES], pull[3 * MAP_CORNERS], sums[9], want[6];
    const double *poses[VGI_LANES];
    for (size_t k = 0; k < VGI_LANES; k++) {
        poses[k] = x[k];
        for (size_t i = 0; i < 3 * MAP_VERTICES; i++) x[k][i] = wave(20 * k + i);
        for (size_t i = 0; i < 9; i++) turn[i][k] = wave(300 + 9 * k + i);
        for (size_t p = 0; p < MAP_PATCHES && k < MAP_POSES; p++)
            for (size_t i = 0; i < 9; i++) {
                m[p].a[i][k] = wave(400 + 20 * k + 9 * p + i), m[p].rotation[i][k] = wave(600 + 20 * k + 9 * p + i);
                if (i < 3) m[p].t[i][k] = wave(800 + 20 * k + 9 * p + i);
            }
    }
    for (size_t i = 0; i < 3 * MAP_CORNERS; i++) pull[i] = wave(900 + i);
    for (size_t i = 0; i < 9; i++) sums[i] = wave(950 + i);
    for (size_t i = 0; i < 6; i++) want[i] = wave(970 + i);
    vgi_map_kernel_now()->face(m + 1, poses, corner, MAP_CORNERS, (const vgi_lanes *)turn, pull, sums);
    vgi_map_kernel_now()->vertex(m, 1, near, 2, poses, 2, want);
    for (size_t c = 0; c < MAP_CORNERS; c++) {
        for (size_t i = 0; i < 3 * VGI_LANES; i++) {
            const double *p = x[i / 3] + i % 3;
            d[i % 3][i / 3] = p[3 * corner[c]] - (p[12] + p[0] + p[9] + p[3]) / 4;
        }
        for (size_t k = 0; k < 3; k++) CHECK_NEAR(pull[3 * c + k], wave(900 + 3 * c + k) + back_of(m[1].a, d, k), 1e-13);
    }
    for (size_t j = 0; j < 3; j++) {
        for (size_t q = 0; q < 3; q++) memcpy(d[q], turn[3 * q + j], sizeof d[q]);
        for (size_t k = 0; k < 3; k++)
            CHECK_NEAR(sums[3 * k + j], wave(950 + 3 * k + j) + back_of(m[1].rotation, d, k), 1e-13);
    }
    for (size_t i = 0; i < 3 * VGI_LANES; i++) d[i % 3][i / 3] = x[i / 3][6 + i % 3] - m[1].t[i % 3][i / 3];
    for (size_t i = 0; i < 6; i++) CHECK_NEAR(want[i], wave(970 + i) + back_of(m[near[i / 3]].a, d, i % 3), 1e-13);
}

static void sums_of_maps(void)
{
    under_each(check_map_sums);
}

/* ---- maps at work ---- */

/* Every number arrives at its place, and nothing is written beside it. */
static void check_spread(void)
{
    enum { ROWS = 37, POSES = 5, FIRST = 2 };
    float single[ROWS * 3 * POSES];
    double twice[ROWS * 3 * POSES], roots[POSES][3], pose[POSES][3 * (ROWS + FIRST + 1)], *vertices[POSES];
    for (size_t i = 0; i < ROWS * 3 * POSES; i++) single[i] = (float)(twice[i] = wave(i));
    for (size_t rows = 1; rows <= ROWS; rows++)
        for (int kind = 0; kind < 2; kind++) {
            for (size_t k = 0; k < POSES; k++) {
                vertices[k] = pose[k];
                for (size_t i = 0; i < 3 * (ROWS + FIRST + 1); i++) pose[k][i] = 77;
                for (size_t a = 0; a < 3; a++) roots[k][a] = wave(1000 + 3 * k + a);
            }
            const double(*at)[3] = (const double(*)[3])roots;
            if (kind) vgi_play_kernel_now()->spread_single(single, rows, POSES, at, vertices, FIRST);
            else vgi_play_kernel_now()->spread_double(twice, rows, POSES, at, vertices, FIRST);
            for (size_t k = 0; k < POSES; k++)
                for (size_t i = 0; i < 3 * (ROWS + FIRST + 1); i++) {
                    size_t v = i / 3, a = i % 3, from = (v - FIRST) * 3 * POSES + 3 * k + a;
                    bool there = v >= FIRST && v < FIRST + rows;
                    CHECK(pose[k][i] == (!there ? 77 : (kind ? (double)single[from] : twice[from]) + roots[k][a]));
                }
        }
}

static void products_are_spread(void)
{
    under_each(check_spread);
}

/* Four rows by one vector, of every length. */
static void check_dots(void)
{
    enum { MOST = 37 };
    double rows[4 * MOST], x[MOST], y[4];
    for (size_t n = 0; n <= MOST; n++) {
        for (size_t i = 0; i < 4 * n; i++) rows[i] = wave(i), x[i / 4] = wave(500 + i);
        vgi_rig_kernel_now()->dots(rows, x, n, y);
        for (size_t k = 0; k < 4; k++) {
            double sum = 0;
            for (size_t i = 0; i < n; i++) sum += rows[k * n + i] * x[i];
            CHECK_NEAR(y[k], sum, 1e-14 * MOST);
        }
        double to[MOST + 1];
        for (size_t i = 0; i <= n; i++) to[i] = wave(900 + i);
        vgi_rig_kernel_now()->add_rows(rows, x, y, n, to);
        for (size_t i = 0; i < n; i++)
            CHECK_NEAR(to[i], wave(900 + i) + y[0] * rows[i] + y[1] * rows[n + i] + y[2] * rows[2 * n + i] + y[3] * x[i], 1e-12);
        CHECK(to[n] == wave(900 + n));
    }
}

static void rows_are_multiplied(void)
{
    under_each(check_dots);
}

TESTS({"choose by name", choose_by_name}, {"numbers are scanned", numbers_are_scanned},
      {"factors are solved", factors_are_solved}, {"rows come and go", rows_come_and_go},
      {"vectors are deformed", vectors_are_deformed}, {"poses are guessed", poses_are_guessed},
      {"rotations are found", rotations_are_found}, {"maps are followed", maps_are_followed},
      {"planes are sought", planes_are_sought}, {"faces are measured", faces_are_measured},
      {"features are summed", features_are_summed},
      {"sums of maps", sums_of_maps},
      {"products are spread", products_are_spread}, {"rows are multiplied", rows_are_multiplied}, {"signals are fitted", signals_are_fitted},
      {"layers are passed", layers_are_passed}, {"fronts are eliminated", fronts_are_eliminated})
