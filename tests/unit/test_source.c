/* test_source.c: the two doors with small generated files: names and order, directories, archives there and back,
 * standard input, damage, and what is left on disk. Leaves out the mesh formats and the bytes of streams, which have
 * their own tests. The process stays in the C locale, where libarchive alone would lose every name that is not ASCII.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"
#include "test.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- a place to work ---- */

static void remove_all(const char *dir)
{
    DIR *d = opendir(dir);
    char path[700];
    if (!d) return;
    for (struct dirent *x; (x = readdir(d));) {
        if (!strcmp(x->d_name, ".") || !strcmp(x->d_name, "..")) continue;
        snprintf(path, sizeof path, "%s/%s", dir, x->d_name);
        if (unlink(path) < 0) remove_all(path);
    }
    closedir(d);
    rmdir(dir);
}

static char place[64];

static void enter_place(void)
{
    snprintf(place, sizeof place, "/tmp/vg-test-XXXXXX");
    CHECK(mkdtemp(place) != NULL);
    CHECK(chdir(place) == 0);
}

static void leave_place(void)
{
    CHECK(chdir("/") == 0);
    remove_all(place);
}

/* How many entries there are, hidden ones too. */
static int entries(const char *dir)
{
    DIR *d = opendir(dir);
    int n = -2;
    if (!d) return -1;
    while (readdir(d)) n++;
    closedir(d);
    return n;
}

static void write_bytes(const char *path, const void *data, size_t n)
{
    FILE *f = fopen(path, "wb");
    CHECK(f && fwrite(data, 1, n, f) == n && fclose(f) == 0);
}

static vg_bytes read_bytes(const char *path)
{
    vg_bytes b = {0};
    vgi_input *in = NULL;
    CHECK(vgi_input_file(&in, path, NULL) == VG_OK && vgi_input_slurp(in, &b, NULL) == VG_OK);
    vgi_input_free(&in);
    return b;
}

/* A tetrahedron with one vertex at height x, so that each pose is known by its number. */
static const char *pose_text(double x)
{
    static char text[200];
    snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 %g\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n", x);
    return text;
}

static void write_pose(const char *path, double x)
{
    write_bytes(path, pose_text(x), strlen(pose_text(x)));
}

/* ---- reading everything ---- */

typedef struct seen {
    int result; /* 0: read to the end */
    vg_err e;
    size_t n;
    double x[64];   /* height of the fourth vertex */
    char names[1000]; /* "pose1 pose2 " */
} seen;

static seen read_all_of(const char *const *operands, size_t n)
{
    seen s = {0};
    vg_source *source;
    vg_frame f = {0};
    size_t used = 0;
    s.result = vg_source_open(&source, operands, n, &s.e);
    if (s.result < 0) return s;
    while ((s.result = vg_source_next(source, &f, &s.e)) > 0 && s.n < 64) {
        s.x[s.n++] = f.values[11];
        used += (size_t)snprintf(s.names + used, sizeof s.names - used, "%s ", f.name);
    }
    vg_frame_clear(&f);
    vg_source_close(&source);
    CHECK(source == NULL);
    return s;
}

static seen read_all(const char *operand)
{
    return read_all_of(&operand, 1);
}

/* ---- writing ---- */

static const vg_sink_options plain = {0};

static void make_head(vg_head *h)
{
    write_pose("head.obj", 1);
    CHECK(vg_load(h, "head.obj", "mesh", NULL) == VG_OK);
    unlink("head.obj");
}

/* n frames named as given, with heights 1, 2, ... Returns what the sink said in the end. */
static int write_frames(const char *output, const vg_sink_options *o, const char *const *names, size_t n, vg_err *e)
{
    vg_head h;
    vg_sink *s;
    vg_frame f = {0};
    make_head(&h);
    int r = vg_sink_open(&s, output, &h, o, e);
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        CHECK(vg_frame_shape(&f, &h, NULL) == VG_OK && vg_frame_rename(&f, names[i], NULL) == VG_OK);
        memcpy(f.values, h.body.reference, 12 * sizeof *f.values);
        f.values[11] = (double)i + 1;
        r = vg_sink_put(s, &f, e);
    }
    if (r == VG_OK) r = vg_sink_end(s, e);
    vg_sink_close(&s);
    vg_frame_clear(&f);
    vg_head_clear(&h);
    return r;
}

static const char *const three[] = {"pose1", "pose2", "pose10"};
static const char *const kinds[] = {"a.zip", "a.tar", "a.tar.gz", "a.tgz", "a.tar.xz", "a.txz", "a.tar.zst", "a.7z"};
enum { KINDS = sizeof kinds / sizeof *kinds };

/* ---- tests: names ---- */

static void natural_order(void)
{
    static const char *const ordered[] = {
        "", "a", "a0", "a00", "a1", "a01", "a1b", "a2", "a9", "a10", "a10b2", "a10b10", "a99999999999999999999999",
        "a100000000000000000000000", "ab", "b", "\xc3\xa4"};
    static const char *const numbers[] = {"-2", "-1.5", "-1.25", "-0.5", "0", "0.0625", "0.125", "0.25", "0.5", "1",
                                          "1.2.3", "1.2.10", "1.10.1", "1.05", "1.5", "2", "10.25",
                                          "a-1", "a-2", "a-10", "a@-10", "a@-2.5", "a@-2.25", "a@0.5", "a_-7", "a_3"};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
            int c = vgi_natural_compare(numbers[i], numbers[k]);
            CHECK(((c > 0) - (c < 0)) == (i > k) - (i < k));
        }
    size_t n = sizeof ordered / sizeof *ordered;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            int c = vgi_natural_compare(ordered[i], ordered[k]);
            /* equal numbers written differently differ by strcmp: "a01" comes before "a1" */
            bool swapped = (!strcmp(ordered[i], "a1") && !strcmp(ordered[k], "a01")) ||
                           (!strcmp(ordered[i], "a01") && !strcmp(ordered[k], "a1"));
            CHECK(((c > 0) - (c < 0)) == ((i > k) - (i < k)) * (swapped ? -1 : 1));
        }
}

static void check_pose_name(const char *path, const char *name)
{
    char *s = vgi_pose_name(path, NULL);
    CHECK(s != NULL);
    if (s) CHECK_TEXT(s, name);
    free(s);
}

static void pose_names(void)
{
    check_pose_name("pose1.obj", "pose1");
    check_pose_name("dir.obj/pose1.OBJ", "pose1");
    check_pose_name("a/b/pose.1.ply", "pose.1");
    check_pose_name("pose1.obj.gz", "pose1");
    check_pose_name("pose1.off.XZ", "pose1");
    check_pose_name("pose1", "pose1");
    check_pose_name("caf\xc3\xa9.obj", "caf\xc3\xa9");
    check_pose_name("caf\xe9.obj", "caf\xc3\xa9");
}

/* ---- tests: files and directories ---- */

static void directories(void)
{
    enter_place();
    CHECK(mkdir("d", 0777) == 0 && mkdir("d/sub.obj", 0777) == 0);
    write_pose("d/p10.obj", 10);
    write_pose("d/p9.obj", 9);
    write_pose("d/.hidden.obj", 0);
    write_pose("d/sub.obj/p1.obj", 1);
    write_bytes("d/notes.txt", "v\n", 2);
    seen s = read_all("d");
    CHECK(s.result == 0 && s.n == 2 && s.x[0] == 9 && s.x[1] == 10);
    CHECK_TEXT(s.names, "p9 p10 ");
    s = read_all("d/");
    CHECK_TEXT(s.names, "p9 p10 ");
    s = read_all("d/p*.obj");
    CHECK(s.result == 0);
    CHECK_TEXT(s.names, "p9 p10 ");
    write_pose("d[1].obj", 3); /* a file of that name comes before a pattern */
    s = read_all("d[1].obj");
    CHECK(s.result == 0 && s.n == 1 && s.x[0] == 3);
    s = read_all("q*.obj");
    CHECK(s.result == VG_ESYS && strstr(s.e.message, "'q*.obj'"));
    s = read_all("q.obj");
    CHECK(s.result == VG_ESYS && strstr(s.e.message, "'q.obj'"));
    CHECK(mkdir("empty", 0777) == 0);
    s = read_all("empty");
    CHECK(s.result == VG_EINPUT && strstr(s.e.message, "'empty'"));
    write_bytes("nothing.obj", "", 0);
    s = read_all("nothing.obj");
    CHECK(s.result == VG_ETRUNC && strstr(s.e.message, "'nothing.obj'"));
    write_bytes("notes.txt", "Dear all, none of this is a mesh.\n", 34);
    s = read_all("notes.txt");
    CHECK(s.result == VG_EINPUT && strstr(s.e.message, "'notes.txt'"));
    leave_place();
}

static void order_of_operands(void)
{
    enter_place();
    const char *const operands[] = {"b.obj", "c.zip", "a.obj"};
    write_pose("a.obj", 21);
    write_pose("b.obj", 20);
    CHECK(write_frames("c.zip", &plain, three, 3, NULL) == VG_OK);
    seen s = read_all_of(operands, 3);
    CHECK(s.result == 0 && s.n == 5 && s.x[0] == 20 && s.x[1] == 1 && s.x[3] == 3 && s.x[4] == 21);
    CHECK_TEXT(s.names, "b pose1 pose2 pose10 a ");
    vg_head h;
    CHECK(vg_load(&h, "c.zip", "mesh", NULL) == VG_OK);
    CHECK(h.body.mesh.nv == 4 && h.body.mesh.nf == 4 && h.body.reference[11] == 1 && h.kind == VG_VERTICES &&
          h.count == 4);
    CHECK_TEXT(h.body.reference_name, "pose1");
    vg_head_clear(&h);
    leave_place();
}

static void mismatch_is_named(void)
{
    enter_place();
    const char *const operands[] = {"a.zip", "b.obj"};
    CHECK(write_frames("a.zip", &plain, three, 3, NULL) == VG_OK);
    write_bytes("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", 32);
    seen s = read_all_of(operands, 2);
    CHECK(s.result == VG_EINPUT && s.n == 3);
    CHECK_TEXT(s.e.message, "'b.obj' has 3 vertices where 'pose1.obj' in 'a.zip' has 4: all poses of a sequence have "
                            "the same vertices and faces");
    leave_place();
}

static void compressed_files(void)
{
    /* the tetrahedron's first lines and the rest, each a gzip stream of its own (gzip -n), joined */
    static const unsigned char joined[] = {
        0x1f, 0x8b, 8,    0,    0,    0,    0,    0,    0,    3,    0x2b, 0x53, 0x30, 0,    0x41, 0xae,
        0x32, 5,    0x43, 0x30, 0x0d, 0,    0x29, 0x2a, 0xd9, 0xc3, 0x10, 0,    0,    0,    0x1f, 0x8b,
        8,    0,    0,    0,    0,    0,    0,    3,    0x2b, 0x53, 0x30, 0x50, 0x30, 0x54, 0x30, 0xe0,
        0x4a, 3,    0x92, 0x46, 0x0a, 0xc6, 0x5c, 0,    0x25, 0xcc, 0xe3, 0xa5, 0x10, 0,    0,    0};
    enter_place();
    write_bytes("p1.obj.gz", joined, sizeof joined);
    vg_head h;
    CHECK(vg_load(&h, "p1.obj.gz", "mesh", NULL) == VG_OK);
    CHECK(h.body.mesh.nv == 3 && h.body.mesh.nf == 1);
    CHECK_TEXT(h.body.reference_name, "p1");
    vg_head_clear(&h);
    for (size_t n = 0; n < sizeof joined; n++) {
        vg_err e = {0};
        if (n == 30)
            continue; /* the first stream alone: whole for gzip, and two vertices without a face are a mesh */
        write_bytes("cut.obj.gz", joined, n);
        CHECK(vg_load(&h, "cut.obj.gz", "mesh", &e) < 0 && vg_exit_status(e.code) == 3);
    }
    unsigned char bad[sizeof joined];
    for (size_t i = 10; i < sizeof joined; i++) { /* the ten bytes of the first header hold nothing that matters */
        if (i >= 34 && i < 40) continue;          /* nor these of the second */
        memcpy(bad, joined, sizeof bad);
        bad[i] ^= 0x11;
        write_bytes("bad.obj.gz", bad, sizeof bad);
        int r = vg_load(&h, "bad.obj.gz", "mesh", NULL);
        CHECK(r == VG_EINPUT || r == VG_ETRUNC);
        if (r == VG_OK) vg_head_clear(&h);
    }
    leave_place();
}

/* ---- tests: streams among the operands ---- */

static void write_stream(const char *path, const char *from, const char *program, vg_kind kind)
{
    vg_source *s;
    vg_writer *w;
    vg_frame f = {0};
    char *argv[] = {(char *)program};
    CHECK(vg_source_open(&s, &from, 1, NULL) == VG_OK);
    vg_head *h = vg_source_head(s);
    CHECK(vg_head_trace(h, program, 1, argv, NULL) == VG_OK);
    if (kind == VG_VECTORS) h->kind = kind, h->links.chosen = true, h->count = vg_mesh_corners(&h->body.mesh);
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    CHECK(fd >= 0 && vg_writer_open(&w, fd, path, h, NULL) == VG_OK);
    while (kind == VG_VERTICES && vg_source_next(s, &f, NULL) > 0) CHECK(vg_writer_put(w, &f, NULL) == VG_OK);
    CHECK(vg_writer_end(w, NULL, NULL) == VG_OK);
    vg_writer_close(&w);
    close(fd);
    vg_frame_clear(&f);
    vg_source_close(&s);
}

static void streams(void)
{
    enter_place();
    const char *const operands[] = {"a.obj", "s.vgs", "t.vgs"}, *const with_vectors[] = {"a.obj", "v.vgs"};
    write_pose("a.obj", 7);
    CHECK(write_frames("three.zip", &plain, three, 3, NULL) == VG_OK);
    write_stream("s.vgs", "three.zip", "first", VG_VERTICES);
    write_stream("t.vgs", "a.obj", "second", VG_VERTICES);
    write_stream("v.vgs", "a.obj", "third", VG_VECTORS);
    seen s = read_all("s.vgs");
    CHECK(s.result == 0);
    CHECK_TEXT(s.names, "pose1 pose2 pose10 ");
    s = read_all_of(operands, 3);
    CHECK(s.result == 0 && s.x[0] == 7 && s.x[4] == 7);
    CHECK_TEXT(s.names, "a pose1 pose2 pose10 a ");
    vg_source *source;
    CHECK(vg_source_open(&source, operands, 3, NULL) == VG_OK);
    CHECK(vg_source_head(source)->nprovenance == 2);
    CHECK_TEXT(vg_source_head(source)->provenance[1].program, "second");
    vg_source_close(&source);
    s = read_all_of(with_vectors, 2);
    CHECK(s.result == VG_EINPUT && strstr(s.e.message, "'v.vgs' holds vectors"));
    CHECK(vg_source_open(&source, &with_vectors[1], 1, NULL) == VG_OK); /* alone it passes as it is */
    CHECK(vg_source_head(source)->kind == VG_VECTORS);
    vg_source_close(&source);
    leave_place();
}

/* ---- tests: archives ---- */

static void there_and_back(void)
{
    static const char *const formats[] = {"obj", "ply", "ply-ascii", "ply-be", "off"};
    enter_place();
    for (size_t i = 0; i < KINDS; i++) {
        vg_sink_options o = {.format = formats[i % 5]};
        CHECK(write_frames(kinds[i], &o, three, 3, NULL) == VG_OK);
        seen s = read_all(kinds[i]);
        CHECK(s.result == 0 && s.n == 3 && s.x[0] == 1 && s.x[1] == 2 && s.x[2] == 3);
        CHECK_TEXT(s.names, "pose1 pose2 pose10 ");
        vg_bytes first = read_bytes(kinds[i]);
        CHECK(write_frames(kinds[i], &o, three, 3, NULL) == VG_OK);
        vg_bytes second = read_bytes(kinds[i]);
        CHECK(first.size == second.size && !memcmp(first.data, second.data, first.size));
        vg_bytes_clear(&first);
        vg_bytes_clear(&second);
    }
    CHECK(entries(".") == KINDS);
    leave_place();
}

static void names_of_all_scripts(void)
{
    static const char *const names[] = {"pose \xc3\xa4", "\xe5\xa7\xbf\xe5\x8a\xbf", "\xf0\x9f\x90\xb4"};
    enter_place();
    for (size_t i = 0; i < KINDS; i++) {
        CHECK(write_frames(kinds[i], &plain, names, 3, NULL) == VG_OK);
        seen s = read_all(kinds[i]);
        CHECK(s.result == 0 && s.n == 3);
        CHECK_TEXT(s.names, "pose \xc3\xa4 \xe5\xa7\xbf\xe5\x8a\xbf \xf0\x9f\x90\xb4 ");
    }
    vg_bytes zip = read_bytes("a.zip");
    CHECK(zip.size > 8 && zip.data[7] & 8); /* bit 11 of the flags: the name is UTF-8 */
    vg_bytes_clear(&zip);
    leave_place();
}

/* An archive as other programs make it: members NAME.obj with heights 1, 2, ..., in this order. */
static void pack_members(const char *archive, const char *const *names, size_t n)
{
    vgi_packer *p;
    int fd = open(archive, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    CHECK(fd >= 0 && vgi_packer_open(&p, fd, archive, strlen(archive), NULL) == VG_OK);
    for (size_t i = 0; i < n; i++) {
        char path[64];
        snprintf(path, sizeof path, "%s.obj", names[i]);
        const char *text = pose_text((double)i + 1);
        CHECK(vgi_packer_add(p, path, text, strlen(text), NULL) == VG_OK);
    }
    CHECK(vgi_packer_end(p, NULL) == VG_OK && close(fd) == 0);
    vgi_packer_close(&p);
}

static void unordered_archives(void)
{
    static const char *const shuffled[] = {"pose10", "pose2", "pose1", "other"};
    enter_place();
    for (size_t i = 0; i < KINDS; i++) {
        pack_members(kinds[i], shuffled, 4);
        seen s = read_all(kinds[i]);
        CHECK(s.result == 0 && s.n == 4 && s.x[0] == 4 && s.x[1] == 3 && s.x[2] == 2 && s.x[3] == 1);
        CHECK_TEXT(s.names, "other pose1 pose2 pose10 ");
    }
    leave_place();
}

/* One header of a tar made by hand: kinds that our writer does not write. */
static void tar_add(FILE *f, const char *name, char type, const char *link, const char *text)
{
    unsigned char h[512] = {0};
    unsigned sum = 0;
    size_t n = strlen(text);
    memcpy(h, name, strlen(name));
    snprintf((char *)h + 100, 8, "%07o", 0644);
    snprintf((char *)h + 108, 8, "%07o", 0);
    snprintf((char *)h + 116, 8, "%07o", 0);
    snprintf((char *)h + 124, 12, "%011o", (unsigned)n);
    snprintf((char *)h + 136, 12, "%011o", 0);
    memset(h + 148, ' ', 8);
    h[156] = (unsigned char)type;
    memcpy(h + 157, link, strlen(link));
    memcpy(h + 257, "ustar\00000", 8);
    for (size_t i = 0; i < 512; i++) sum += h[i];
    snprintf((char *)h + 148, 8, "%06o", sum);
    CHECK(fwrite(h, 1, 512, f) == 512);
    memset(h, 0, sizeof h);
    CHECK(fwrite(text, 1, n, f) == n && fwrite(h, 1, (512 - n % 512) % 512, f) == (512 - n % 512) % 512);
}

static void tar_end(FILE *f)
{
    static const char zeros[1024];
    CHECK(fwrite(zeros, 1, sizeof zeros, f) == sizeof zeros && fclose(f) == 0);
}

static void odd_members(void)
{
    enter_place();
    FILE *f = fopen("odd.tar", "wb");
    tar_add(f, "ply/", '5', "", ""); /* looks like the start of a PLY file, but for the rest */
    tar_add(f, "ply/README", '0', "", "v 1 2 3\n");
    tar_add(f, "./ply/b/p1.obj", '0', "", pose_text(3));
    tar_add(f, "ply/b/._p1.obj", '0', "", "left by a Mac");
    tar_add(f, "/ply/b/caf\xe9.obj", '0', "", pose_text(2));
    tar_add(f, "ply/b/z.obj", '2', "p1.obj", "");
    tar_add(f, "ply/a/p9.obj", '0', "", pose_text(1));
    tar_end(f);
    seen s = read_all("odd.tar");
    CHECK(s.result == 0 && s.n == 3 && s.x[0] == 1 && s.x[1] == 2 && s.x[2] == 3);
    CHECK_TEXT(s.names, "p9 caf\xc3\xa9 p1 ");

    f = fopen("link.tar", "wb");
    tar_add(f, "p1.obj", '0', "", pose_text(1));
    tar_add(f, "p2.obj", '1', "p1.obj", "");
    tar_end(f);
    s = read_all("link.tar");
    CHECK(s.result == VG_EINPUT && strstr(s.e.message, "'p2.obj' in 'link.tar'"));

    f = fopen("none.tar", "wb");
    tar_add(f, "README", '0', "", "nothing here");
    tar_end(f);
    s = read_all("none.tar");
    CHECK(s.result == VG_EINPUT && strstr(s.e.message, "holds no mesh file"));

    f = fopen("bad.tar", "wb");
    tar_add(f, "p1.obj", '0', "", pose_text(1));
    tar_add(f, "p2.obj", '0', "", "v 0 0 0\nf 1 2 3\n");
    tar_end(f);
    s = read_all("bad.tar");
    CHECK(s.result == VG_EINPUT && s.n == 1 && strstr(s.e.message, "'p2.obj' in 'bad.tar'"));
    leave_place();
}

static void encrypted_zip(void)
{
    static const unsigned char zip[] = {
        /* zip -X -P secret e.zip a.obj */
        0x50, 0x4b, 3,    4,    0x14, 0,    9,    0,    8,    0,    0x6b, 4,    0x76, 0x5d, 0x43, 0xf9, 0x6e, 0x2a,
        0x22, 0,    0,    0,    0x20, 0,    0,    0,    5,    0,    0,    0,    0x61, 0x2e, 0x6f, 0x62, 0x6a, 0x3a,
        0x28, 0xa7, 0xb8, 0x85, 0x99, 0xea, 0x10, 0x2e, 0x2f, 0xc7, 0xdc, 0x39, 0x32, 0x38, 0x69, 0x34, 0x56, 0xad,
        0xae, 0x45, 0x33, 0x20, 0x64, 0x65, 0xe5, 0x30, 0x8f, 0xf9, 0xa9, 0x85, 0xde, 0x44, 0x52, 0x50, 0x4b, 7,
        8,    0x43, 0xf9, 0x6e, 0x2a, 0x22, 0,    0,    0,    0x20, 0,    0,    0,    0x50, 0x4b, 1,    2,    0x1e,
        3,    0x14, 0,    9,    0,    8,    0,    0x6b, 4,    0x76, 0x5d, 0x43, 0xf9, 0x6e, 0x2a, 0x22, 0,    0,
        0,    0x20, 0,    0,    0,    5,    0,    0,    0,    0,    0,    0,    0,    1,    0,    0,    0,    0xa4,
        0x81, 0,    0,    0,    0,    0x61, 0x2e, 0x6f, 0x62, 0x6a, 0x50, 0x4b, 5,    6,    0,    0,    0,    0,
        1,    0,    1,    0,    0x33, 0,    0,    0,    0x55, 0,    0,    0,    0,    0};
    enter_place();
    write_bytes("e.zip", zip, sizeof zip);
    seen s = read_all("e.zip");
    CHECK(s.result == VG_EINPUT && strstr(s.e.message, "'a.obj' in 'e.zip' is encrypted"));
    leave_place();
}

static bool as_written(const seen *s)
{
    return s->result == 0 && s->n == 3 && s->x[0] == 1 && s->x[1] == 2 && s->x[2] == 3;
}

/* A cut archive is refused, with its name. Only a tar may lose zeros behind its contents,
 * and must then give all of them. */
static void check_cut(const vg_bytes *b, size_t n, bool tar)
{
    write_bytes("cut", b->data, n);
    seen s = read_all("cut");
    if (tar && n + 512 >= b->size && s.result == 0) CHECK(as_written(&s));
    else CHECK((s.result == VG_EINPUT || s.result == VG_ETRUNC) && strstr(s.e.message, "'cut'"));
}

static void every_97th_prefix(void)
{
    enter_place();
    for (size_t i = 0; i < KINDS; i++) {
        bool tar = !strcmp(kinds[i], "a.tar");
        CHECK(write_frames(kinds[i], &plain, three, 3, NULL) == VG_OK);
        vg_bytes b = read_bytes(kinds[i]);
        for (size_t n = 0; n < b.size; n += 97) check_cut(&b, n, tar);
        for (size_t n = 1; n <= 4; n++) check_cut(&b, b.size - n, tar);
        for (size_t n = 512; tar && n < b.size; n += 512) check_cut(&b, n, tar); /* between two members, too */
        vg_bytes_clear(&b);
    }
    leave_place();
}

/* A tar ends before its compressed data do: the last bytes must be missed even when the buffers are smaller than the
 * file. */
static void cut_behind_the_end_mark(void)
{
    static const char *const packed[] = {"a.tar.gz", "a.tar.xz", "a.tar.zst"};
    static char numbered[400][8];
    const char *names[400];
    for (int i = 0; i < 400; i++) snprintf(numbered[i], 8, "p%d", i), names[i] = numbered[i];
    enter_place();
    for (size_t i = 0; i < 3; i++) {
        CHECK(write_frames(packed[i], &plain, names, 400, NULL) == VG_OK);
        vg_bytes b = read_bytes(packed[i]);
        for (size_t n = 1; n < 24; n += 3) check_cut(&b, b.size - n, false);
        CHECK(vgi_bytes_append(&b, "\0\0\0", 3, NULL) == VG_OK); /* padding of a tape */
        write_bytes("padded", b.data, b.size);
        vg_head h;
        int r = vg_load(&h, "padded", "mesh", NULL);
        CHECK(i > 0 || r == VG_OK);
        if (r == VG_OK) vg_head_clear(&h);
        if (i == 0) {
            b.data[b.size - 1] = 'x';
            write_bytes("more", b.data, b.size);
            CHECK(vg_load(&h, "more", "mesh", NULL) == VG_EINPUT);
        }
        vg_bytes_clear(&b);
    }
    leave_place();
}

/* Zip, 7z, xz and gzip hold checksums of the contents: a changed byte is refused, or changed nothing that is read. */
static void changed_bytes(void)
{
    static const size_t summed[] = {0, 2, 4, 7};
    enter_place();
    for (size_t i = 0; i < 4; i++) {
        const char *kind = kinds[summed[i]];
        CHECK(write_frames(kind, &plain, three, 3, NULL) == VG_OK);
        vg_bytes b = read_bytes(kind);
        size_t refused = 0;
        for (size_t n = 0; n < b.size; n += 3) {
            b.data[n] ^= (unsigned char)(1 << n % 8);
            write_bytes("bad", b.data, b.size);
            b.data[n] ^= (unsigned char)(1 << n % 8);
            seen s = read_all("bad");
            /* a changed name, or a member that no longer looks like a mesh file, is no damage to any pose */
            bool known = true;
            for (size_t k = 0; k < s.n; k++) known = known && s.x[k] >= 1 && s.x[k] <= 3 && s.x[k] == floor(s.x[k]);
            CHECK(known);
            refused += s.result < 0;
        }
        CHECK(refused > b.size / 12);
        vg_bytes_clear(&b);
    }
    leave_place();
}

static void limits(void)
{
    enter_place();
    CHECK(write_frames("a.tar.gz", &plain, three, 3, NULL) == VG_OK);
    const vgi_limits tight[] = {{50, 1 << 20, 10}, {1 << 20, 300, 10}, {1 << 20, 1 << 20, 2}};
    for (size_t i = 0; i < 3; i++) {
        vgi_archive *a;
        vg_err e = {0};
        vg_bytes data = {0};
        const char *path;
        int r = vgi_archive_open(&a, open("a.tar.gz", O_RDONLY), 0, "a.tar.gz", &tight[i], &e);
        while (a && (r = vgi_archive_next(a, &path, &data, &e)) > 0) continue;
        CHECK(r == VG_EINPUT && strstr(e.message, "more than"));
        vgi_archive_close(&a);
        vg_bytes_clear(&data);
    }
    leave_place();
}

/* Where members are packed as one, what is passed over is unpacked too, and counts. */
static void limits_count_what_is_passed_over(void)
{
    static const struct {
        const char *name;
        bool solid;
    } made[] = {{"a.7z", true}, {"a.zip", false}, {"a.tar", false}};
    const vgi_limits tight = {1 << 20, 1 << 20, 10};
    const size_t junk = 8 << 20;
    unsigned char *zeros = calloc(junk, 1);
    enter_place();
    for (size_t i = 0; i < 3; i++) {
        static const char mesh[] = "v 0 0 0\n";
        vgi_packer *p;
        vgi_archive *a;
        vg_err e = {0};
        int fd = open(made[i].name, O_RDWR | O_CREAT, 0600);
        CHECK(vgi_packer_open(&p, fd, made[i].name, strlen(made[i].name), &e) == VG_OK);
        CHECK(vgi_packer_add(p, "a.bin", zeros, junk, &e) == VG_OK);
        CHECK(vgi_packer_add(p, "b.obj", mesh, sizeof mesh - 1, &e) == VG_OK && vgi_packer_end(p, &e) == VG_OK);
        vgi_packer_close(&p);
        int r = vgi_archive_open(&a, fd, 0, made[i].name, &tight, &e);
        CHECK(made[i].solid ? r == VG_EINPUT && strstr(e.message, "unpacks to more than 1048576 bytes") : r == VG_OK);
        vgi_archive_close(&a);
    }
    free(zeros);
    leave_place();
}

/* When one of several files cannot take its name, none of them keeps its. */
static void files_take_their_names_together(void)
{
    vg_targets t = {0};
    vg_err e = {0};
    enter_place();
    CHECK(mkdir("d", 0777) == 0);
    int one = vg_targets_open(&t, "one", &e), two = vg_targets_open(&t, "d/two", &e);
    CHECK(one >= 0 && two >= 0 && access("one", F_OK) < 0 && access("d/two", F_OK) < 0);
    CHECK(vg_target_close(one, "one", &e) == VG_OK && vg_target_close(two, "two", &e) == VG_OK);
    CHECK(rename("d", "gone") == 0);
    CHECK(vg_targets_rename(&t, &e) == VG_ESYS && access("one", F_OK) == 0);
    vg_targets_remove(&t);
    CHECK(access("one", F_OK) < 0);
    vg_targets_clear(&t);
    leave_place();
}

/* ---- tests: standard input ---- */

/* What is read when these bytes come through a pipe. Small enough to wait in the pipe. */
static seen read_piped(const void *data, size_t n)
{
    int ends[2], before = dup(0);
    CHECK(pipe(ends) == 0 && write(ends[1], data, n) == (ssize_t)n);
    close(ends[1]);
    dup2(ends[0], 0);
    close(ends[0]);
    seen s = read_all("-");
    dup2(before, 0);
    close(before);
    return s;
}

static void standard_input(void)
{
    static const char *const shuffled[] = {"pose10", "pose2", "pose1"};
    enter_place();
    for (size_t i = 0; i < KINDS; i++) {
        pack_members(kinds[i], i % 2 ? three : shuffled, 3);
        vg_bytes b = read_bytes(kinds[i]);
        seen s = read_piped(b.data, b.size);
        CHECK(s.result == 0 && s.n == 3 && s.x[0] == (i % 2 ? 1 : 3));
        CHECK_TEXT(s.names, "pose1 pose2 pose10 ");
        int before = dup(0), fd = open(kinds[i], O_RDONLY);
        dup2(fd, 0);
        close(fd);
        s = read_all("-"); /* a file: no copy is needed */
        CHECK_TEXT(s.names, "pose1 pose2 pose10 ");
        dup2(before, 0);
        close(before);
        vg_bytes_clear(&b);
    }
    seen s = read_piped(pose_text(5), strlen(pose_text(5)));
    CHECK(s.result == 0 && s.n == 1 && s.x[0] == 5);
    CHECK_TEXT(s.names, "stdin ");
    s = read_piped("", 0);
    CHECK(s.result == VG_ETRUNC && strstr(s.e.message, "standard input is empty"));
    const char *const twice[] = {"-", "-"};
    s = read_all_of(twice, 2);
    CHECK(s.result == VG_EARG);
    CHECK(write_frames("a.vgs.zip", &plain, three, 3, NULL) == VG_OK);
    write_stream("s.vgs", "a.vgs.zip", "first", VG_VERTICES);
    vg_bytes b = read_bytes("s.vgs");
    s = read_piped(b.data, b.size);
    CHECK_TEXT(s.names, "pose1 pose2 pose10 ");
    vg_bytes_clear(&b);
    leave_place();
}

/* ---- tests: the door out ---- */

static void series_and_directories(void)
{
    vg_err e;
    vg_sink_options o = {.first_number = 98};
    enter_place();
    CHECK(write_frames("p-%03d.obj", &o, three, 3, &e) == VG_OK);
    CHECK(access("p-098.obj", R_OK) == 0 && access("p-100.obj", R_OK) == 0 && entries(".") == 3);
    CHECK(write_frames("100%%-%d.off", &o, three, 1, &e) == VG_OK && access("100%-98.off", R_OK) == 0);
    CHECK(write_frames("new/", &plain, three, 3, &e) == VG_OK && entries("new") == 3);
    CHECK(write_frames("new:ply", &plain, three, 3, &e) == VG_EARG && entries("new") == 3);
    CHECK(mkdir("other", 0777) == 0 && write_frames("other:ply", &plain, three, 3, &e) == VG_OK);
    seen s = read_all("other/*.ply");
    CHECK(as_written(&s));
    CHECK(write_frames("a.zip:off", &plain, three, 3, &e) == VG_OK && access("a.zip", R_OK) == 0);
    CHECK(write_frames("one.ply", &plain, three, 1, &e) == VG_OK);
    s = read_all("one.ply");
    CHECK(s.result == 0 && s.n == 1);
    struct stat st;
    mode_t mask = umask(022);
    CHECK(write_frames("mode.obj", &plain, three, 1, &e) == VG_OK && stat("mode.obj", &st) == 0);
    CHECK((st.st_mode & 0777) == 0644);
    umask(mask);
    CHECK(symlink("one.ply", "link.ply") == 0 && write_frames("link.ply", &plain, &three[1], 1, &e) == VG_OK);
    CHECK(lstat("link.ply", &st) == 0 && S_ISLNK(st.st_mode));
    leave_place();
}

static void refused_names(void)
{
    static const char *const wrong[] = {"out.xyz",    "out",         "p-%s.obj",  "p-%d-%d.obj",
                                        "p-%-4d.obj", "p-%999d.obj", "p-%04.obj", "100%.obj",
                                        "a.zip:foo",  "new/:xyz",    ""};
    vg_err e;
    enter_place();
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        CHECK(vg_sink_check(wrong[i], &plain, &e) == VG_EARG && *e.message);
        CHECK(write_frames(wrong[i], &plain, three, 1, &e) == VG_EARG);
    }
    CHECK(vg_sink_check("out.obj", &(vg_sink_options){.format = "fbx"}, &e) == VG_EARG && strstr(e.message, "'fbx'"));
    CHECK(vg_sink_check("out.xyz", &(vg_sink_options){.format = "off"}, &e) == VG_OK);
    CHECK(vg_sink_check("out.obj", &(vg_sink_options){.first_number = -1}, &e) == VG_EARG);
    CHECK(vg_sink_check("missing/out.obj", &plain, &e) == VG_ESYS);
    CHECK(vg_sink_check("missing/out/", &plain, &e) == VG_ESYS);
    CHECK(vg_sink_check("missing/p-%d.obj", &plain, &e) == VG_ESYS);
    CHECK(vg_sink_check("/dev/null", &(vg_sink_options){.format = "obj"}, &e) == VG_OK);
    CHECK(vg_sink_check("-", &plain, &e) == VG_OK);
    CHECK(entries(".") == 0);
    leave_place();
}

/* What is read back from `output` is the n frames in order. */
static void check_order(const char *output, size_t n)
{
    seen s = read_all(output);
    CHECK(s.result == 0 && s.n == n);
    for (size_t i = 0; i < s.n; i++) CHECK(s.x[i] == (double)i + 1);
}

/* Names that are no file names, or that are there twice, are made into names with a number in front. */
static void frames_whose_names_are_no_file_names(void)
{
    static const char *const odd[][2] = {{"a", "a"}, {"a", ""}, {"", "a"}, {"a", "b/c"}, {"a", "."}, {"a", ".."},
                                         {"a", ".b"}, {"../b", "c"}, {"a", "b\\c"}};
    vg_err e;
    seen s;
    enter_place();
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        char directory[8];
        snprintf(directory, sizeof directory, "d%zu/", i);
        CHECK(write_frames("a.zip", &plain, odd[i], 2, &e) == VG_OK);
        check_order("a.zip", 2);
        CHECK(write_frames(directory, &plain, odd[i], 2, &e) == VG_OK && entries(directory) == 2);
        check_order(directory, 2);
    }
    s = read_all("d3/");
    CHECK_TEXT(s.names, "0000_a 0001_b_c ");
    s = read_all("d0/");
    CHECK_TEXT(s.names, "0000_a 0001_a ");
    CHECK(entries(".") == 1 + sizeof odd / sizeof *odd);
    leave_place();
}

/* Property: whatever the frames are called, and however many there are, they come back in their order. */
static void any_names_come_back_in_order(void)
{
    static const char *const parts[] = {"a", "b", "pose", "~", "@", "_", "-", ".", "/", " ", "0", "1", "2", "9", "10",
                                        "25", "5", "125", "0.5", "-3", ".obj", "\xc3\xa9", "A", "%", "\\", "(", "+"};
    static const char *const places[] = {"a.zip", "a.tar", "a.7z", "a.tar.zst", "d/", "a.npz", "a.zip:ply", "d/:off"};
    uint64_t state = 20260101;
    enter_place();
    for (int round = 0; round < 60; round++) {
        char text[40][64];
        const char *names[40];
        size_t n = 1 + (size_t)round % 40;
        for (size_t i = 0; i < n; i++) {
            size_t used = 0;
            text[i][0] = 0;
            for (int k = 0; k < 4; k++) {
                state = state * 6364136223846793005u + 1442695040888963407u;
                size_t part = (size_t)(state >> 33) % (sizeof parts / sizeof *parts + 4);
                if (part < sizeof parts / sizeof *parts)
                    used += (size_t)snprintf(text[i] + used, sizeof text[i] - used, "%s", parts[part]);
            }
            names[i] = text[i];
        }
        const char *to = places[(size_t)round % (sizeof places / sizeof *places)];
        vg_sink_options o = {.replace = true};
        vg_err e = {0};
        CHECK(write_frames(to, &o, names, n, &e) == VG_OK);
        char bare[16];
        snprintf(bare, sizeof bare, "%.*s", (int)strcspn(to, ":"), to);
        check_order(bare, n);
    }
    leave_place();
}

/* Names of poses between keys, as vg-interpolate gives them: they sort, so that no number is needed. */
static void moments_between_keys(void)
{
    static const char *const names[] = {"a", "a~b@0.125", "a~b@0.25", "a~b@0.5", "b", "b~c@0.0625", "b~c@0.9", "c"};
    static const char *const backwards[] = {"a~b@-0.5", "a"};
    vg_err e;
    enter_place();
    CHECK(write_frames("a.zip", &plain, names, 8, &e) == VG_OK && write_frames("d/", &plain, names, 8, &e) == VG_OK);
    seen s = read_all("a.zip");
    CHECK_TEXT(s.names, "a a~b@0.125 a~b@0.25 a~b@0.5 b b~c@0.0625 b~c@0.9 c ");
    check_order("a.zip", 8);
    check_order("d", 8);
    CHECK(write_frames("b.zip", &plain, backwards, 2, &e) == VG_OK);
    s = read_all("b.zip");
    CHECK_TEXT(s.names, "0000_a~b@-0.5 0001_a ");
    leave_place();
}

/* Files of an earlier set would be read with the new ones. */
static void earlier_sets(void)
{
    const vg_sink_options replace = {.replace = true}, from2 = {.first_number = 2};
    vg_err e;
    enter_place();
    CHECK(write_frames("d/", &plain, three, 3, &e) == VG_OK);
    write_bytes("d/notes.txt", "x", 1);
    write_pose("d/other.obj", 9);
    CHECK(write_frames("d/", &plain, three, 2, &e) == VG_EARG && strstr(e.message, "--replace") && entries("d") == 5);
    CHECK(vg_sink_check("d/", &plain, &e) == VG_EARG && vg_sink_check("d/:ply", &plain, &e) == VG_EARG);
    CHECK(write_frames("d/", &replace, three, 2, &e) == VG_OK && entries("d") == 3); /* the notes stay */
    check_order("d", 2);
    CHECK(write_frames("d/:off", &replace, three, 3, &e) == VG_OK && entries("d") == 4);
    check_order("d", 3);
    CHECK(write_frames("d/", &replace, three, 0, &e) == VG_OK && entries("d") == 1);

    write_pose("p-x.obj", 9);
    CHECK(write_frames("p-%02d.obj", &plain, three, 3, &e) == VG_OK && entries(".") == 5);
    CHECK(write_frames("p-%02d.obj", &plain, three, 2, &e) == VG_EARG && strstr(e.message, "'p-00.obj'"));
    CHECK(vg_sink_check("p-%d.obj", &plain, &e) == VG_EARG && vg_sink_check("p-%02d.ply", &plain, &e) == VG_OK);
    CHECK(write_frames("p-%02d.obj", &from2, three, 1, &e) == VG_EARG); /* number 2 is there */
    CHECK(write_frames("p-%02d.obj", &replace, three, 2, &e) == VG_OK && access("p-02.obj", F_OK) < 0);
    CHECK(write_frames("p-%02d.obj", &from2, three, 1, &e) == VG_OK && entries(".") == 5); /* goes on */
    write_pose("a*1].obj", 1);
    CHECK(write_frames("a*%d].obj", &plain, three, 1, &e) == VG_EARG && vg_sink_check("a?%d].obj", &plain, &e) == VG_OK);
    leave_place();
}

/* A number that is read as a decimal, or as a negative one, would sort the wrong way round. */
static void series_that_would_not_sort(void)
{
    static const char *const dozen[] = {"", "", "", "", "", "", "", "", "", "", "", ""};
    vg_err e;
    enter_place();
    CHECK(write_frames("p2.%d.obj", &plain, dozen, 12, &e) == VG_EARG && strstr(e.message, "'p2.10.obj'"));
    CHECK(write_frames("p_-%d.obj", &plain, dozen, 3, &e) == VG_EARG && entries(".") == 0);
    CHECK(write_frames("p2.%02d.obj", &plain, dozen, 12, &e) == VG_OK);
    check_order("p2.*.obj", 12);
    CHECK(write_frames("q-%d.obj", &plain, dozen, 12, &e) == VG_OK);
    check_order("q-*.obj", 12);
    leave_place();
}

static void refused_frames(void)
{
    static const char *const bad[] = {"a", ""};
    vg_err e;
    enter_place();
    CHECK(write_frames("p-%d.obj", &plain, bad, 2, &e) == VG_OK && entries(".") == 2);
    write_bytes("one.obj", "old", 3);
    CHECK(write_frames("one.obj", &plain, three, 2, &e) == VG_EARG && strstr(e.message, "'one-%04d.obj'"));
    CHECK(write_frames("one.obj", &plain, three, 0, &e) == VG_EINPUT);
    vg_bytes old = read_bytes("one.obj");
    CHECK(old.size == 3 && entries(".") == 3); /* what was there stays */
    vg_bytes_clear(&old);
    leave_place();
}

static void other_kinds_are_refused(void)
{
    vg_head h;
    vg_sink *s;
    vg_err e;
    enter_place();
    make_head(&h);
    h.kind = VG_VECTORS;
    CHECK(vg_sink_open(&s, "a.obj", &h, &plain, &e) == VG_EINPUT && strstr(e.message, "vg-solve") && s == NULL);
    CHECK(entries(".") == 0);
    vg_head_clear(&h);
    leave_place();
}

static void full_disk(void)
{
    vg_err e;
    vg_sink_options o = {.format = "obj"};
    enter_place();
    CHECK(write_frames("/dev/full", &o, three, 1, &e) == VG_ESYS && strstr(e.message, "'/dev/full'"));
    CHECK(symlink("/dev/full", "full.tar") == 0);
    CHECK(write_frames("full.tar", &plain, three, 3, &e) == VG_ESYS && strstr(e.message, "'full.tar'"));
    CHECK(symlink("/dev/full", "p-1.obj") == 0);
    CHECK(write_frames("p-%d.obj", &plain, three, 3, &e) == VG_ESYS && strstr(e.message, "'p-1.obj'"));
    CHECK(entries(".") == 2); /* p-0.obj never came to be */
    leave_place();
}

static void named_pipe(void)
{
    char text[400];
    enter_place();
    CHECK(mkfifo("pipe.obj", 0600) == 0);
    int fd = open("pipe.obj", O_RDWR | O_NONBLOCK);
    CHECK(write_frames("pipe.obj", &plain, three, 1, NULL) == VG_OK);
    ssize_t n = read(fd, text, sizeof text);
    CHECK(n > 8 && strstr(text, "v ") && entries(".") == 1);
    close(fd);
    leave_place();
}

static void abandoned(void)
{
    enter_place();
    const char *const outputs[] = {"a.obj", "p-%d.obj", "new/", "a.zip", "a.7z"};
    for (size_t i = 0; i < 5; i++) {
        vg_head h;
        vg_sink *s;
        vg_frame f = {0};
        make_head(&h);
        CHECK(vg_sink_open(&s, outputs[i], &h, &plain, NULL) == VG_OK);
        CHECK(vg_frame_shape(&f, &h, NULL) == VG_OK && vg_frame_rename(&f, "a", NULL) == VG_OK);
        memcpy(f.values, h.body.reference, 12 * sizeof *f.values);
        CHECK(vg_sink_put(s, &f, NULL) == VG_OK);
        CHECK(access("a.obj", F_OK) < 0 && access("p-0.obj", F_OK) < 0 && access("new/a.obj", F_OK) < 0 &&
              access("a.zip", F_OK) < 0);
        vg_sink_close(&s);
        CHECK(entries(".") == 0);
        vg_frame_clear(&f);
        vg_head_clear(&h);
    }
    leave_place();
}

TESTS({"natural order of names", natural_order}, {"names of poses", pose_names},
      {"directories and patterns", directories}, {"operands in order, archives among them", order_of_operands},
      {"a mesh that does not fit is named", mismatch_is_named}, {"compressed mesh files", compressed_files},
      {"streams among operands", streams}, {"archives there and back, the same bytes twice", there_and_back},
      {"names that are not ASCII", names_of_all_scripts}, {"archives out of order", unordered_archives},
      {"odd members of archives", odd_members}, {"encrypted members", encrypted_zip},
      {"every 97th prefix of an archive", every_97th_prefix}, {"cut behind the end mark", cut_behind_the_end_mark},
      {"changed bytes of archives", changed_bytes}, {"limits of archives", limits}, 
      {"limits count what is passed over", limits_count_what_is_passed_over},
      {"files take their names together", files_take_their_names_together},
      {"standard input", standard_input}, {"series and directories", series_and_directories},
      {"names of outputs that are refused", refused_names}, {"frames that are refused", refused_frames},
      {"names that are no file names", frames_whose_names_are_no_file_names},
      {"any names come back in order", any_names_come_back_in_order},
      {"names between keys", moments_between_keys}, {"files of an earlier set", earlier_sets},
      {"series that would not sort", series_that_would_not_sort},
      {"only vertices are written", other_kinds_are_refused}, {"a full disk", full_disk},
      {"a named pipe", named_pipe}, {"nothing is left behind", abandoned})
