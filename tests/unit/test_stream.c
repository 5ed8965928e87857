/* test_stream.c: every kind of stream is read back as it was written; every prefix and every changed byte is refused;
 * what may stand where; lengths that lie; numbers that are none. Streams are taken apart and put together here,
 * checksums included.
 * Leaves out the second implementation and the corpora (stream.bats).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "frames.h"
#include "io/io.h"
#include "model/artefact.h"
#include "meshes.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <xxhash.h>

#if defined(__SANITIZE_ADDRESS__)
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

enum { CRITICAL = 1, COPY_SAFE = 2 };

/* ---- streams as bytes and as lists of records ---- */

static void append(vg_bytes *b, const void *data, size_t n)
{
    vg_err e;
    if (vgi_bytes_append(b, data, n, &e) < 0) abort();
}

static void append32(vg_bytes *b, uint32_t x)
{
    unsigned char p[4];
    vgi_put32(p, x);
    append(b, p, 4);
}

static void append64(vg_bytes *b, uint64_t x)
{
    append32(b, (uint32_t)x);
    append32(b, (uint32_t)(x >> 32));
}

static void append_text(vg_bytes *b, const char *s)
{
    static const unsigned char zeros[8];
    size_t n = strlen(s);
    append64(b, n);
    if (vgi_bytes_append(b, s, n, NULL) < 0 || vgi_bytes_append(b, zeros, -n & 7, NULL) < 0) abort();
}

enum { MOST = 64 };

typedef struct record {
    char tag[5];
    uint32_t flags;
    vg_bytes payload;
} record;

typedef struct parts {
    size_t n;
    record at[MOST];
} parts;

static parts take_apart(const vg_bytes *stream)
{
    parts p = {0};
    for (size_t at = 16; at < stream->size;) {
        record *r = &p.at[p.n++];
        const unsigned char *h = stream->data + at;
        size_t length = (size_t)vgi_get64(h + 8);
        memcpy(r->tag, h, 4);
        r->flags = vgi_get32(h + 4);
        append(&r->payload, h + 32, length);
        at += 32 + (length + 7) / 8 * 8;
    }
    return p;
}

static void drop(parts *p)
{
    for (size_t i = 0; i < p->n; i++) vg_bytes_clear(&p->at[i].payload);
    p->n = 0;
}

static void put_file_header(vg_bytes *b)
{
    append(b, "\x89VGS\r\n\x1a" "1\0\0\0\0\0\0\0\0", 16);
}

/* `claim` bytes are claimed, payload is what is there */
static void put_record_claiming(vg_bytes *b, const char *tag, uint32_t flags, const vg_bytes *payload, uint64_t claim)
{
    size_t from = b->size;
    append(b, tag, 4);
    append32(b, flags);
    append64(b, claim);
    append64(b, XXH64(payload->data, payload->size, 0));
    append64(b, XXH64(b->data + from, 24, 0));
    append(b, payload->data, payload->size);
    append(b, "\0\0\0\0\0\0\0", -payload->size & 7);
}

static void put_record(vg_bytes *b, const char *tag, uint32_t flags, const vg_bytes *payload)
{
    put_record_claiming(b, tag, flags, payload, payload->size);
}

static void put_end(vg_bytes *b)
{
    XXH64_state_t *sum = XXH64_createState();
    uint64_t count = 0;
    XXH64_reset(sum, 0);
    for (size_t at = 16; at < b->size; count++) {
        XXH64_update(sum, b->data + at + 24, 8);
        at += 32 + ((size_t)vgi_get64(b->data + at + 8) + 7) / 8 * 8;
    }
    vg_bytes end = {0};
    append64(&end, count);
    append64(&end, XXH64_digest(sum));
    put_record(b, "END ", CRITICAL, &end);
    vg_bytes_clear(&end);
    XXH64_freeState(sum);
}

/* order: positions in p, end with -1; an END of their own is made */
static vg_bytes put_together(const parts *p, const int *order)
{
    vg_bytes b = {0};
    put_file_header(&b);
    for (; *order >= 0; order++) {
        const record *r = &p->at[*order];
        put_record(&b, r->tag, r->flags, &r->payload);
    }
    put_end(&b);
    return b;
}

static int find(const parts *p, const char *tag)
{
    for (size_t i = 0; i < p->n; i++)
        if (!strcmp(p->at[i].tag, tag)) return (int)i;
    abort();
}

/* ---- writing and reading ---- */

typedef struct content {
    vg_head head;
    size_t n;
    vg_frame frame[4];
    vg_records tail;
} content;

static void content_clear(content *c)
{
    vg_head_clear(&c->head);
    for (size_t i = 0; i < c->n; i++) vg_frame_clear(&c->frame[i]);
    vg_records_clear(&c->tail);
}

static int write_stream(const content *c, vg_bytes *out, vg_err *e)
{
    int fd = memfd_create("stream", 0);
    vg_writer *w = NULL;
    int r = vg_writer_open(&w, fd, "out", &c->head, e);
    for (size_t i = 0; r == VG_OK && i < c->n; i++) r = vg_writer_put(w, &c->frame[i], e);
    if (r == VG_OK) r = vg_writer_end(w, &c->tail, e);
    vg_writer_close(&w);
    CHECK(w == NULL);
    off_t size = lseek(fd, 0, SEEK_END);
    unsigned char *data = room((size_t)size, 1);
    CHECK(pread(fd, data, (size_t)size, 0) == size);
    append(out, data, (size_t)size);
    free(data);
    close(fd);
    return r;
}

static vg_bytes written(const content *c)
{
    vg_bytes b = {0};
    vg_err e = {0, ""};
    if (write_stream(c, &b, &e) < 0) printf("%s\n", e.message), exit(1);
    return b;
}

/* All of an open reader; c may be NULL. Keeps at most 4 frames, by value. */
static int read_rest(vg_reader *reader, content *c, vg_err *e)
{
    vg_frame f = {0};
    int r;
    size_t n = 0;
    while ((r = vg_reader_next(reader, &f, e)) > 0) {
        vg_head *h = vg_reader_head(reader);
        if (!c || n == 4) continue;
        vg_frame *to = &c->frame[n++];
        c->n = n;
        if (vg_frame_shape(to, h, e) < 0 || vg_frame_label(to, &f, e) < 0) abort();
        memcpy(to->values, f.values, h->count * vg_head_width(h) * sizeof(double));
        memcpy(to->root, f.root, sizeof f.root);
        copy_channels(to, &f);
    }
    if (r == 0) {
        CHECK(vg_reader_next(reader, &f, e) == 0); /* the end stays the end */
        if (c) {
            c->tail = *vg_reader_tail(reader);
            *vg_reader_tail(reader) = (vg_records){0};
            c->head = *vg_reader_head(reader);
            *vg_reader_head(reader) = (vg_head){0};
        }
    }
    vg_frame_clear(&f);
    return r;
}

static int read_memory(const void *data, size_t n, content *c, vg_err *e)
{
    vg_reader *reader = NULL;
    void *copy = malloc(n ? n : 1); /* of its exact size, so that the sanitizer sees a byte read too far */
    if (n) memcpy(copy, data, n);
    int r = vg_reader_open_memory(&reader, copy, n, "in.vgs", e);
    CHECK((r < 0) == (reader == NULL));
    if (r == VG_OK) r = read_rest(reader, c, e);
    vg_reader_close(&reader);
    free(copy);
    return r;
}

static bool same_records(const vg_records *a, const vg_records *b)
{
    bool same = a->n == b->n;
    for (size_t i = 0; same && i < a->n; i++) {
        const vg_record *p = &a->at[i], *q = &b->at[i];
        same = !strcmp(p->tag, q->tag) && p->flags == q->flags && p->payload.size == q->payload.size &&
               (p->payload.size == 0 || !memcmp(p->payload.data, q->payload.data, p->payload.size));
    }
    return same;
}

static bool same_text(const char *a, const char *b)
{
    return !strcmp(a ? a : "", b ? b : "");
}

static bool same_memory(const void *a, const void *b, size_t n)
{
    return n == 0 || !memcmp(a, b, n);
}

static bool same_head(const vg_head *a, const vg_head *b)
{
    vg_err e;
    size_t corners = vg_mesh_corners(&a->body.mesh);
    bool same =
        vg_mesh_same(&a->body.mesh, "a", &b->body.mesh, "b", &e) == VG_OK &&
        !a->body.reference == !b->body.reference && same_text(a->body.reference_name, b->body.reference_name) &&
        a->kind == b->kind && a->precision == b->precision && a->count == b->count && a->selection.n == b->selection.n &&
        a->links.n == b->links.n && a->nanchors == b->nanchors && a->selection.chosen == b->selection.chosen &&
        a->links.chosen == b->links.chosen && a->nprovenance == b->nprovenance && same_records(&a->extra, &b->extra);
    if (!same) return false;
    same &= same_memory(a->body.reference, b->body.reference, a->body.reference ? 24 * a->body.mesh.nv : 0);
    same &= same_memory(a->selection.faces, b->selection.faces, 4 * a->selection.n);
    same &= same_memory(a->links.pairs, b->links.pairs, 8 * a->links.n);
    same &= same_memory(a->anchors, b->anchors, 4 * a->nanchors);
    const vg_attributes *p = &a->body.attributes, *q = &b->body.attributes;
    same &= p->ntex == q->ntex && p->nlabels == q->nlabels && (!p->ntex || p->tex_dim == q->tex_dim);
    same = same && same_memory(p->tex, q->tex, 8 * p->ntex * p->tex_dim) &&
           same_memory(p->corner_tex, q->corner_tex, p->ntex ? 4 * corners : 0);
    for (size_t i = 0; same && i < p->nlabels; i++)
        same = p->labels[i].face == q->labels[i].face && p->labels[i].kind == q->labels[i].kind &&
               !strcmp(p->labels[i].text, q->labels[i].text);
    for (size_t i = 0; same && i < a->nprovenance; i++) {
        const vg_provenance *u = &a->provenance[i], *v = &b->provenance[i];
        same = !strcmp(u->program, v->program) && !strcmp(u->version, v->version) && u->nargs == v->nargs &&
               u->nparents == v->nparents && same_memory(u->parents, v->parents, 4 * u->nparents);
        for (size_t k = 0; same && k < u->nargs; k++) same = !strcmp(u->args[k], v->args[k]);
    }
    same = same && a->body.skeleton.njoints == b->body.skeleton.njoints;
    for (size_t i = 0; same && i < a->body.skeleton.njoints; i++) {
        const vg_joint *u = &a->body.skeleton.joints[i], *v = &b->body.skeleton.joints[i];
        same = !strcmp(u->name, v->name) && u->parent == v->parent && u->nchannels == v->nchannels &&
               !memcmp(u->offset, v->offset, sizeof u->offset) && !memcmp(u->channels, v->channels, u->nchannels);
    }
    const vg_rig *g = &a->body.rig, *k = &b->body.rig;
    size_t n = g->skeleton.njoints, skin = g->skin_bone ? VG_SKIN * a->body.mesh.nv : 0;
    same = same && n == k->skeleton.njoints && g->nbones == k->nbones && !g->skin_bone == !k->skin_bone &&
           same_memory(g->at, k->at, 24 * n) && same_memory(g->turn, k->turn, 32 * n) &&
           same_memory(g->bone, k->bone, 4 * g->nbones) && same_memory(g->skin_bone, k->skin_bone, 4 * skin) &&
           same_memory(g->skin_weight, k->skin_weight, 8 * skin);
    const vg_correspondence *c = &a->correspondence, *d = &b->correspondence;
    same = same && !c->first == !d->first;
    if (!same || !c->first) return same;
    size_t nf = c->target_nf;
    same = c->source_nv == d->source_nv && c->source_nf == d->source_nf && c->target_nv == d->target_nv &&
           nf == d->target_nf && c->source_digest == d->source_digest && c->target_digest == d->target_digest &&
           same_memory(c->first, d->first, 4 * (nf + 1));
    return same && same_memory(c->source, d->source, 4 * c->first[nf]) &&
           same_memory(c->weight, d->weight, 8 * c->first[nf]) && same_memory(c->distance, d->distance, 8 * nf) &&
           same_memory(c->matched, d->matched, nf);
}

static bool same_frame(const vg_frame *a, const vg_frame *b, const vg_head *h)
{
    bool graph = h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS, same = same_text(a->name, b->name);
    same &= a->has_time == b->has_time && a->time == b->time && same_records(&a->extra, &b->extra);
    same &= same_memory(a->values, b->values, h->count * vg_head_width(h) * sizeof(double));
    same &= same_channels(a, b);
    if (graph) same &= !memcmp(a->root, b->root, 24);
    return same;
}

static bool same_content(const content *a, const content *b)
{
    bool same = same_head(&a->head, &b->head) && a->n == b->n && same_records(&a->tail, &b->tail);
    for (size_t i = 0; same && i < a->n; i++) same = same_frame(&a->frame[i], &b->frame[i], &a->head);
    return same;
}

/* ---- what is written ---- */

static vg_record unknown(const char *tag, uint32_t flags, const char *text)
{
    vg_record r = {.flags = flags};
    memcpy(r.tag, tag, 5);
    append(&r.payload, text, strlen(text));
    return r;
}

static void add_unknown(vg_records *list, const char *tag, uint32_t flags, const char *text)
{
    if (!(list->at = realloc(list->at, (list->n + 1) * sizeof *list->at))) abort();
    list->at[list->n++] = unknown(tag, flags, text);
}

static void add_provenance(vg_head *h, const char *a, const char *b, const char *c)
{
    char *const args[] = {(char *)(uintptr_t)a, (char *)(uintptr_t)b, (char *)(uintptr_t)c};
    vg_err e;
    CHECK(vg_head_trace(h, a, 3, args, &e) == VG_OK);
}

static void add_attributes(vg_head *h, uint32_t dim)
{
    size_t corners = vg_mesh_corners(&h->body.mesh);
    vg_attributes *a = &h->body.attributes;
    a->ntex = 3, a->tex_dim = dim, a->tex = room(3 * dim, 8), a->corner_tex = room(corners, 4);
    for (size_t i = 0; i < 3 * dim; i++) a->tex[i] = 0.1 * (double)i - 0.3;
    for (size_t i = 0; i < corners; i++) a->corner_tex[i] = i % 4 == 3 ? UINT32_MAX : (uint32_t)(i % 4);
    static const struct {
        uint64_t face;
        uint32_t kind;
        const char *text;
    } labels[] = {{0, VG_LABEL_LIBRARY, "a.mtl"}, {0, VG_LABEL_OBJECT, ""}, {1, VG_LABEL_GROUP, "k\xc3\xb6rper"},
                  {2, VG_LABEL_MATERIAL, "12345678"}, {3, VG_LABEL_SMOOTHING, "off"}};
    a->nlabels = 5, a->labels = room(5, sizeof *a->labels);
    for (size_t i = 0; i < 5; i++) a->labels[i] = (vg_label){labels[i].face, labels[i].kind, strdup(labels[i].text)};
}

static void add_skeleton(vg_head *h)
{
    vg_skeleton *s = &h->body.skeleton;
    s->njoints = h->body.mesh.nv, s->joints = room(s->njoints, sizeof *s->joints);
    for (size_t i = 0; i < s->njoints; i++) {
        vg_joint *j = &s->joints[i];
        char name[] = "joint.";
        name[5] = (char)('a' + i);
        *j = (vg_joint){.name = strdup(i == 1 ? "" : name),
                        .parent = i ? (uint32_t)i - 1 : UINT32_MAX,
                        .nchannels = i % 2 ? 3 : 6};
        for (uint32_t k = 0; k < j->nchannels; k++) j->channels[k] = (uint8_t)(6 - k), j->offset[k % 3] = 0.25 * k;
    }
}

/* The same skeleton moves the mesh; the weights are those of one bone, or of two. */
static void add_rig(vg_head *h)
{
    size_t n = h->body.skeleton.njoints;
    double *at = room(3 * n, 8), *turns = room(4 * n, 8);
    vg_err e;
    for (size_t k = 0; k < 3 * n; k++) at[k] = noise();
    for (size_t j = 0; j < n; j++) turns[4 * j] = 0.6, turns[4 * j + 1 + j % 3] = -0.8;
    if (vg_rig_make(&h->body.rig, &h->body.skeleton, at, turns, &e) < 0) abort();
    h->body.rig.skin_bone = room(VG_SKIN * h->body.mesh.nv, 4),
    h->body.rig.skin_weight = room(VG_SKIN * h->body.mesh.nv, 8);
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        h->body.rig.skin_bone[VG_SKIN * v] = (uint32_t)(v % n),
                                        h->body.rig.skin_weight[VG_SKIN * v] = v % 2 ? 1 : 0.75;
        h->body.rig.skin_weight[VG_SKIN * v + 1] = v % 2 ? 0 : 0.25;
    }
    free(at);
    free(turns);
}

static void add_correspondence(vg_head *h)
{
    vg_correspondence *c = &h->correspondence;
    *c = (vg_correspondence){.source_nv = 9,
                             .source_nf = 8,
                             .target_nv = 5,
                             .target_nf = 3,
                             .source_digest = 1,
                             .target_digest = 2,
                             .first = room(4, 4),
                             .source = room(4, 4),
                             .weight = room(4, 8),
                             .distance = room(3, 8),
                             .matched = room(3, 1)};
    static const uint32_t first[] = {0, 1, 3, 4}, source[] = {7, 0, 5, 0};
    static const double weight[] = {1, 0.25, 0.75, 1};
    memcpy(c->first, first, sizeof first), memcpy(c->source, source, sizeof source),
        memcpy(c->weight, weight, sizeof weight);
    c->distance[1] = 0.5, c->matched[2] = 1;
}

enum { PLAIN, FULL };

/* A stream of a kind: PLAIN has what must be there; FULL has every record, and unknown ones everywhere.
 * Values fit into binary32. */
static content make(vg_kind kind, vg_precision precision, int how)
{
    content c = {.n = 2};
    vg_head *h = &c.head;
    *h = make_ngon(4, 0, 0.25);
    add_vertex(h, 1.5, 0.5, 0.25), add_vertex(h, 3, 0, 0), add_vertex(h, -9, 0, 0);
    FACE(h, 1, 0, 4);
    FACE(h, 2, 4);
    h->kind = kind, h->precision = precision;
    if (how == FULL) {
        add_provenance(h, "vg-encode", "a b.obj", "");
        add_provenance(h, "vg-deform", "--onto", "\xc3\xa4.obj");
        add_attributes(h, kind % 3 + 1);
        h->selection.chosen = true, h->selection.n = 2, h->selection.faces = room(2, 4), h->selection.faces[1] = 1;
        h->nanchors = 2, h->anchors = room(2, 4), h->anchors[0] = 1, h->anchors[1] = 4;
        add_skeleton(h);
        add_rig(h);
        add_correspondence(h);
        add_unknown(&h->extra, "NOTE", COPY_SAFE, "in the head");
        add_unknown(&h->extra, "X 12", COPY_SAFE | 0xabcd0000, "");
        add_unknown(&c.tail, "LAST", COPY_SAFE, "tail");
    }
    if (how == FULL || kind == VG_VECTORS || kind == VG_DEFORMATIONS) {
        h->links.chosen = true, h->links.n = 1, h->links.pairs = room(2, 4), h->links.pairs[0] = 3, h->links.pairs[1] = 5;
    }
    size_t on_graph = (how == FULL ? 7 : 9) + 2;
    h->count = kind == VG_VERTICES ? h->body.mesh.nv : kind == VG_TRANSFORMS ? 3 : on_graph;
    for (size_t i = 0; i < c.n; i++) {
        vg_frame *f = &c.frame[i];
        vg_err e;
        if (vg_frame_shape(f, h, &e) < 0) abort();
        CHECK(vg_frame_rename(f, i ? "a pose of its own" : "", &e) == VG_OK);
        f->has_time = how == FULL, f->time = f->has_time ? -0.5 + (double)i : 0;
        for (size_t k = 0; k < h->count * vg_kind_width(kind); k++) f->values[k] = (double)(float)noise();
        for (size_t k = 0; k < 3; k++) f->root[k] = noise();
        for (size_t k = 0; k < 3 * h->nanchors; k++) if (vg_frame_anchors(f)) vg_frame_anchors(f)[k] = noise();
        if (how == FULL && kind == VG_VECTORS) /* an even and an odd number of pins */
            CHECK(vg_frame_pin(f, (uint32_t[]){0, 2, 6}, 2 + i, &e) == VG_OK);
        if (how == FULL && kind == VG_VERTICES && i)
            CHECK(vg_frame_turn(f, h->body.rig.turn, h->body.rig.skeleton.njoints, &e) == VG_OK);
        if (how == FULL && kind == VG_VERTICES && i) /* any numbers will do: the first of the frame */
            CHECK(vg_frame_set_scalars(f, "error", i == 1 ? "D" : "", f->values, h->body.mesh.nv, &e) == VG_OK);
        if (how == FULL && i) add_unknown(&f->extra, "MID ", COPY_SAFE, "before a frame");
        if (how == FULL && i) add_unknown(&f->extra, "MID ", COPY_SAFE, "");
    }
    return c;
}

static content make_bare_transforms(void)
{
    content c = make(VG_TRANSFORMS, VG_F64, PLAIN);
    vg_head *h = &c.head;
    size_t count = h->count;
    vg_head_clear(h);
    *h = (vg_head){.kind = VG_TRANSFORMS, .precision = VG_F64, .count = count};
    return c;
}

/* ---- there and back ---- */

static void there_and_back(const content *c, const char *what)
{
    vg_bytes once = written(c), twice = {0};
    vg_err e = {0, ""};
    content back = {0};
    int r = read_memory(once.data, once.size, &back, &e);
    if (r < 0) printf("%s: %s\n", what, e.message);
    CHECK(r == 0);
    if (r == 0) {
        if (!same_content(c, &back)) printf("%s:\n", what);
        CHECK(same_content(c, &back));
        CHECK(back.head.body.reference_name != NULL);
        CHECK(write_stream(&back, &twice, &e) == VG_OK);
        CHECK(once.size == twice.size && !memcmp(once.data, twice.data, once.size));
        CHECK(once.size % 8 == 0 && vgi_is_stream(once.data, once.size));
    }
    content_clear(&back);
    vg_bytes_clear(&once);
    vg_bytes_clear(&twice);
}

static void test_there_and_back(void)
{
    for (int kind = VG_VERTICES; kind <= VG_TRANSFORMS; kind++)
        for (int precision = 4; precision <= 8; precision += 4)
            for (int how = PLAIN; how <= FULL; how++) {
                content c = make((vg_kind)kind, (vg_precision)precision, how);
                there_and_back(&c, vg_kind_name((vg_kind)kind));
                size_t n = c.n;
                c.n = 0; /* no frame at all is a stream, too */
                there_and_back(&c, "no frames");
                c.n = n;
                content_clear(&c);
            }
    content c = make_bare_transforms();
    there_and_back(&c, "transforms without a mesh");
    content_clear(&c);
    c = (content){.head = new_shape()};
    there_and_back(&c, "no vertices");
    add_isolated(&c.head);
    there_and_back(&c, "no faces");
    content_clear(&c);
}

static void test_numbers(void)
{
    static const double wild[] = {0,   -0.0,   5e-324,     -5e-324, 1.7976931348623157e308, -1.7976931348623157e308,
                                  0.1, 1e-310, 1 + 0x1p-52};
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    memcpy(c.frame[0].values, wild, sizeof wild);
    memcpy(c.head.body.reference, wild, sizeof wild);
    there_and_back(&c, "extreme numbers");
    c.frame[0].has_time = true, c.frame[0].time = -1e300;
    there_and_back(&c, "an extreme time");
    content_clear(&c);

    static const double rounded[] = {0.1, 3.4028234663852886e38, 1e-40, 1e-50, -0.0, 16777217};
    static const float want[] = {0.1f, 3.4028234663852886e38f, 1e-40f, 0, -0.0f, 16777216};
    c = make(VG_VERTICES, VG_F32, PLAIN);
    memcpy(c.frame[0].values, rounded, sizeof rounded);
    memcpy(c.head.body.reference, rounded, sizeof rounded);
    vg_bytes b = written(&c);
    content back = {0};
    vg_err e = {0, ""};
    CHECK(read_memory(b.data, b.size, &back, &e) == 0);
    for (size_t i = 0; i < 6; i++) {
        double got = back.frame[0].values[i];
        CHECK(got == (double)want[i] && !signbit(got) == !signbit(want[i]));
    }
    CHECK(
        !memcmp(back.head.body.reference, c.head.body.reference, sizeof rounded)); /* the reference stays binary64 */
    content_clear(&back);
    vg_bytes_clear(&b);
    content_clear(&c);
}

/* ---- every prefix, every byte ---- */

static void refuse(const void *data, size_t n, int code, const char *what)
{
    vg_err e = {0, ""};
    int r = read_memory(data, n, NULL, &e);
    bool told = r < 0 && e.code == r && strstr(e.message, "in.vgs") && !strchr(e.message, '\n');
    if (!told || (code && r != code)) printf("%s: %d, \"%s\"\n", what, r, e.message);
    CHECK(told);
    if (code) CHECK(r == code);
}

static void every_prefix(const vg_bytes *b)
{
    char what[40];
    for (size_t n = 0; n < b->size; n++) {
        snprintf(what, sizeof what, "the first %zu bytes", n);
        refuse(b->data, n, VG_ETRUNC, what);
    }
    vg_err e = {0, ""};
    CHECK(read_memory(b->data, 0, NULL, &e) == VG_ETRUNC &&
          strstr(e.message, "is empty: did the program before it fail?"));
}

/* Bytes 8 to 11 are the minor version, which a reader takes as it comes. */
static void every_byte(vg_bytes *b, bool all_values)
{
    char what[60];
    for (size_t i = 0; i < b->size; i++) {
        unsigned char was = b->data[i];
        for (unsigned x = 1; x < 256; x++) {
            if (!all_values && x != 1 && x != 0x20 && x != 0x80 && x != 0xff) continue;
            b->data[i] = (unsigned char)(was ^ x);
            snprintf(what, sizeof what, "byte %zu changed from %02x to %02x", i, was, was ^ x);
            if (i >= 8 && i < 12) {
                vg_err e = {0, ""};
                CHECK(read_memory(b->data, b->size, NULL, &e) == 0);
            } else {
                refuse(b->data, b->size, 0, what);
            }
        }
        b->data[i] = was;
    }
}

static void test_damage(void)
{
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    vg_bytes b = written(&c);
    every_prefix(&b);
    every_byte(&b, true);
    vg_bytes_clear(&b);
    content_clear(&c);
    for (int kind = VG_VECTORS; kind <= VG_DEFORMATIONS; kind++) {
        c = make((vg_kind)kind, VG_F32, FULL), b = written(&c);
        every_prefix(&b);
        every_byte(&b, false);
        vg_bytes_clear(&b);
        content_clear(&c);
    }
}

static void test_behind_the_end(void)
{
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    vg_bytes b = written(&c), copy = {0};
    append(&copy, b.data, b.size);
    append(&b, "", 1);
    refuse(b.data, b.size, VG_EINPUT, "a zero byte behind the end");
    b.size--;
    append(&b, copy.data, copy.size);
    refuse(b.data, b.size, VG_EINPUT, "a stream behind the end");
    vg_bytes_clear(&b);
    vg_bytes_clear(&copy);
    content_clear(&c);
}

/* Records that are moved, left out or doubled with all their checksums: the END mark knows. */
static void test_end_mark(void)
{
    content c = make(VG_VERTICES, VG_F64, FULL);
    vg_bytes b = written(&c), n = {0};
    parts p = take_apart(&b);
    size_t last = p.n - 1, frame = (size_t)find(&p, "FRAM");
    CHECK(!strcmp(p.at[last].tag, "END "));
    for (int how = 0; how < 3; how++) {
        n.size = 0;
        put_file_header(&n);
        for (size_t i = 0; i < p.n; i++) {
            /* the first frame left out; there twice; replaced by the second: the count is right, the sum is not */
            const record *r = how == 2 && i == frame ? &p.at[last - 2] : &p.at[i];
            if (how == 0 && i == frame) continue;
            put_record(&n, r->tag, r->flags, &r->payload);
            if (how == 1 && i == frame) put_record(&n, r->tag, r->flags, &r->payload);
        }
        refuse(n.data, n.size, VG_EINPUT, "records behind the END mark's back");
    }
    n.size = 0;
    put_file_header(&n);
    for (size_t i = 0; i < p.n; i++) put_record(&n, p.at[i].tag, p.at[i].flags, &p.at[i].payload);
    CHECK(n.size == b.size && !memcmp(n.data, b.data, n.size)); /* that was the same stream, made here */
    for (int more = -1; more <= 1; more += 2) { /* all sums are right, the count is not */
        n.size = 0;
        put_file_header(&n);
        vgi_put64(p.at[last].payload.data, (uint64_t)((int64_t)last + more));
        for (size_t i = 0; i < p.n; i++) put_record(&n, p.at[i].tag, p.at[i].flags, &p.at[i].payload);
        refuse(n.data, n.size, VG_EINPUT, "a false count in the END mark");
    }
    drop(&p);
    vg_bytes_clear(&b);
    vg_bytes_clear(&n);
    content_clear(&c);
}

/* ---- which record where ---- */

static bool is_unknown(const char *tag)
{
    return !strcmp(tag, "NOTE") || !strcmp(tag, "X 12") || !strcmp(tag, "MID ") || !strcmp(tag, "LAST");
}

static bool may_repeat(const char *tag)
{
    return is_unknown(tag) || !strcmp(tag, "PROV") || !strcmp(tag, "FRAM");
}

/* Whether the records in this order are a valid stream. what: what is wrong otherwise. */
static void expect(const parts *p, const int *order, bool valid, const char *what)
{
    vg_bytes x = put_together(p, order);
    vg_err e = {0, ""};
    if (valid) CHECK(read_memory(x.data, x.size, NULL, &e) == 0);
    else refuse(x.data, x.size, VG_EINPUT, what);
    vg_bytes_clear(&x);
}

static void repeat_record(const parts *p, int n, int i)
{
    char what[80];
    int order[MOST + 2], k = 0;
    for (int j = 0; j < n; j++) {
        order[k++] = j;
        if (j == i) order[k++] = j;
    }
    order[k] = -1;
    snprintf(what, sizeof what, "two %s records", p->at[i].tag);
    expect(p, order, may_repeat(p->at[i].tag), what);
}

/* SELE and LINK change how many corners there are, ANCH the size of a frame; SKIN needs RIG. */
static void leave_out_record(const parts *p, int n, int i)
{
    const char *tag = p->at[i].tag;
    char what[80];
    int order[MOST + 2], k = 0;
    bool may_miss = may_repeat(tag) || !strcmp(tag, "TEXC") || !strcmp(tag, "LABL") || !strcmp(tag, "SKEL") ||
                    !strcmp(tag, "CORR") || !strcmp(tag, "SKIN");
    if (!strcmp(tag, "PROV")) may_miss = i != 0; /* the second names the first as its parent */
    for (int j = 0; j < n; j++)
        if (j != i) order[k++] = j;
    order[k] = -1;
    snprintf(what, sizeof what, "no %s record", tag);
    expect(p, order, may_miss, what);
}

/* Before MESH, and after FORM. */
static void move_record(const parts *p, int n, int i)
{
    const char *tag = p->at[i].tag;
    const int form = find(p, "FORM"), mesh = find(p, "MESH");
    const bool needs_mesh = strstr("TEXC LABL SELE LINK ANCH REFP SKEL RIG  SKIN FORM FRAM", tag) && !is_unknown(tag);
    for (int place = 0; place < 2 && i != mesh; place++) {
        char what[80];
        int order[MOST + 2], k = 0;
        for (int j = 0; j < n; j++) {
            if (place == 0 && j == mesh) order[k++] = i;
            if (j != i) order[k++] = j;
            if (place == 1 && j == form && i != form) order[k++] = i;
        }
        order[k] = -1;
        bool refused = place == 0 ? needs_mesh : !may_repeat(tag) || !strcmp(tag, "PROV");
        if (i == form && place == 1) refused = true; /* then it is missing */
        if (i == 0 && place == 0) refused = true;    /* a PROV behind the one that names it as its parent */
        snprintf(what, sizeof what, "%s %s", tag, place ? "behind FORM" : "before MESH");
        expect(p, order, !refused, what);
    }
}

/* Any order that keeps MESH first, and RIG before SKIN, is the same stream. */
static void other_order(const parts *p, int n, const content *c)
{
    const int form = find(p, "FORM"), mesh = find(p, "MESH"), rig = find(p, "RIG ");
    int order[MOST + 2], k = 0;
    content back = {0};
    vg_err e = {0, ""};
    order[k++] = mesh;
    order[k++] = rig;
    for (int j = form - 1; j >= 0; j--)
        if (j != mesh && j != rig && strcmp(p->at[j].tag, "PROV") && !(p->at[j].flags & COPY_SAFE)) order[k++] = j;
    for (int j = 0; j < n; j++)
        if (j >= form || (j != mesh && j != rig && (!strcmp(p->at[j].tag, "PROV") || (p->at[j].flags & COPY_SAFE)))) order[k++] = j;
    order[k] = -1;
    CHECK(k == n);
    vg_bytes x = put_together(p, order);
    CHECK(read_memory(x.data, x.size, &back, &e) == 0);
    CHECK(same_content(c, &back));
    content_clear(&back);
    vg_bytes_clear(&x);
}

static void test_order(void)
{
    content c = make(VG_VECTORS, VG_F64, FULL);
    vg_bytes b = written(&c);
    parts p = take_apart(&b);
    const int n = (int)p.n - 1;
    for (int i = 0; i < n; i++) {
        repeat_record(&p, n, i);
        leave_out_record(&p, n, i);
        move_record(&p, n, i);
    }
    other_order(&p, n, &c);
    drop(&p);
    vg_bytes_clear(&b);
    content_clear(&c);
}

static void test_unknown(void)
{
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    vg_bytes b = written(&c), note = {0};
    append(&note, "what?", 5);
    parts p = take_apart(&b);
    for (size_t place = 0; place < p.n; place++)
        for (uint32_t flags = 0; flags < 4; flags++) {
            vg_bytes x = {0};
            put_file_header(&x);
            for (size_t i = 0; i < p.n - 1; i++) {
                if (i == place) put_record(&x, "WHAT", flags | 0x10000, &note);
                put_record(&x, p.at[i].tag, p.at[i].flags, &p.at[i].payload);
            }
            if (place == p.n - 1) put_record(&x, "WHAT", flags | 0x10000, &note);
            put_end(&x);
            content back = {0};
            vg_err e = {0, ""};
            int r = read_memory(x.data, x.size, &back, &e);
            if (flags & CRITICAL) {
                CHECK(r == VG_EINPUT && strstr(e.message, "'WHAT'") && strstr(e.message, "newer version"));
            } else {
                size_t head = back.head.extra.n, frames = 0, tail = back.tail.n, want = flags == COPY_SAFE;
                for (size_t i = 0; i < back.n; i++) frames += back.frame[i].extra.n;
                CHECK(r == 0 && head + frames + tail == want && back.n == c.n);
                size_t which = back.frame[1].extra.n; /* the frame it came before */
                const vg_records *list = head ? &back.head.extra : tail ? &back.tail : &back.frame[which].extra;
                if (want && list->n) CHECK(list->at[0].flags == (flags | 0x10000) && list->at[0].payload.size == 5);
                /* FORM is the third record, then two frames */
                if (want) CHECK(place <= 2 ? head == 1 : place <= 4 ? frames == 1 : tail == 1);
            }
            content_clear(&back);
            vg_bytes_clear(&x);
        }
    /* bits that must be zero */
    for (int bit = 2; bit < 16; bit++) {
        vg_bytes x = {0};
        put_file_header(&x);
        put_record(&x, "WHAT", COPY_SAFE | 1u << bit, &note);
        for (size_t i = 0; i < p.n - 1; i++) put_record(&x, p.at[i].tag, p.at[i].flags, &p.at[i].payload);
        put_end(&x);
        refuse(x.data, x.size, VG_EINPUT, "a reserved flag");
        vg_bytes_clear(&x);
    }
    drop(&p);
    vg_bytes_clear(&note);
    vg_bytes_clear(&b);
    content_clear(&c);
}

/* ---- numbers that are none ---- */

/* x with one double of one record changed, checksums right */
static void refuse_number(const parts *p, size_t index, size_t offset, double x, const char *what)
{
    vg_bytes b = {0};
    put_file_header(&b);
    for (size_t i = 0; i + 1 < p->n; i++) {
        vg_bytes payload = {0};
        append(&payload, p->at[i].payload.data, p->at[i].payload.size);
        if (i == index) {
            uint64_t bits;
            memcpy(&bits, &x, 8);
            vgi_put64(payload.data + offset, bits);
        }
        put_record(&b, p->at[i].tag, p->at[i].flags, &payload);
        vg_bytes_clear(&payload);
    }
    put_end(&b);
    refuse(b.data, b.size, VG_EINPUT, what);
    vg_bytes_clear(&b);
}

static void test_not_finite_in(void)
{
    static const double none[] = {NAN, INFINITY, -INFINITY};
    content c = make(VG_DEFORMATIONS, VG_F64, FULL);
    vg_bytes b = written(&c);
    parts p = take_apart(&b);
    size_t frame = (size_t)find(&p, "FRAM"), refp = (size_t)find(&p, "REFP"), texc = (size_t)find(&p, "TEXC");
    size_t skel = (size_t)find(&p, "SKEL"), corr = (size_t)find(&p, "CORR");
    for (size_t i = 0; i < 3; i++) {
        /* the first frame has no name: time, root, two anchors, values from byte 8 on */
        for (size_t at = 8; at < p.at[frame].payload.size; at += 8) refuse_number(&p, frame, at, none[i], "FRAM");
        for (size_t at = 16; at < p.at[refp].payload.size; at += 8) refuse_number(&p, refp, at, none[i], "REFP");
        refuse_number(&p, texc, 16, none[i], "TEXC");
        refuse_number(&p, skel, 16, none[i], "SKEL"); /* an offset of the first joint */
        /* weights, distances */
        for (size_t at = 88; at < 88 + 7 * 8; at += 8) refuse_number(&p, corr, at, none[i], "CORR");
    }
    drop(&p);
    vg_bytes_clear(&b);
    content_clear(&c);
}

static void cannot_write(const content *c, const char *what)
{
    vg_bytes b = {0};
    vg_err e = {0, ""};
    int r = write_stream(c, &b, &e);
    if (r != VG_EINPUT) printf("%s: %d\n", what, r);
    CHECK(r == VG_EINPUT && e.code == r && e.message[0]);
    CHECK(read_memory(b.data, b.size, NULL, &e) < 0); /* what was written until then is no stream */
    vg_bytes_clear(&b);
}

static void test_not_finite_out(void)
{
    static const double none[] = {NAN, INFINITY, -INFINITY};
    for (int kind = VG_VERTICES; kind <= VG_TRANSFORMS; kind++)
        for (int precision = 4; precision <= 8; precision += 4) {
            content c = make((vg_kind)kind, (vg_precision)precision, FULL);
            bool graph = kind == VG_VECTORS || kind == VG_DEFORMATIONS;
            size_t last = c.head.count * vg_kind_width(c.head.kind) - 1;
            double *places[] = {&c.frame[1].values[0],     &c.frame[1].values[last], &c.frame[1].time,
                                &c.head.body.reference[2], &c.frame[0].root[1],      graph ? &vg_frame_anchors(&c.frame[0])[5] : NULL};
            for (size_t i = 0; i < (graph ? 6 : 4); i++)
                for (size_t k = 0; k < 3; k++) {
                    double was = *places[i];
                    *places[i] = none[k];
                    cannot_write(&c, vg_kind_name((vg_kind)kind));
                    *places[i] = was;
                }
            if (precision == 4) {
                double was = c.frame[1].values[last];
                c.frame[1].values[last] = 3.5e38;
                cannot_write(&c, "too large for binary32");
                c.frame[1].values[last] = was;
            }
            if (vg_kind_width(c.head.kind) > 3) {
                double *q = c.frame[0].values + vg_kind_width(c.head.kind);
                q[0] = q[1] = q[2] = q[3] = precision == 4 ? 1e-60 : 0; /* 0 in binary32 */
                cannot_write(&c, "a quaternion of 0");
                q[2] = precision == 4 ? 1e-30 : 1e-300;
                there_and_back(&(content){.head = c.head}, "the head alone");
                vg_bytes b = {0};
                vg_err e;
                CHECK(write_stream(&c, &b, &e) == VG_OK);
                vg_bytes_clear(&b);
            }
            content_clear(&c);
        }
}

/* ---- lengths that lie ---- */

/* All of `data` is read in a process of at most 1 GiB more memory than it has; the answer is its code. */
static int read_in_small_memory(const vg_bytes *b, bool from_pipe)
{
    pid_t child = fork();
    if (child == 0) {
        struct rlimit limit = {1u << 30, 1u << 30};
        vg_err e = {0, ""};
        if (!SANITIZED) setrlimit(RLIMIT_AS, &limit);
        int r;
        if (from_pipe) {
            vg_reader *reader = NULL;
            int fd = memfd_create("in", 0);
            if (write(fd, b->data, b->size) != (ssize_t)b->size || lseek(fd, 0, SEEK_SET) < 0) _exit(99);
            r = vg_reader_open(&reader, fd, "in.vgs", &e);
            if (r == VG_OK) r = read_rest(reader, NULL, &e);
        } else {
            r = read_memory(b->data, b->size, NULL, &e);
        }
        _exit(-r);
    }
    int status = -1;
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status));
    return WIFEXITED(status) ? -WEXITSTATUS(status) : 1;
}

static void test_lying_lengths(void)
{
    static const uint64_t claims[] = {1u << 20,          (uint64_t)1 << 31,       (uint64_t)1 << 32,
                                      (uint64_t)1 << 40, ((uint64_t)1 << 40) + 1, (uint64_t)1 << 62,
                                      UINT64_MAX};
    static const char *const tags[] = {"PROV", "MESH", "WHAT", "FRAM"};
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    vg_bytes whole = written(&c), some = {0};
    parts p = take_apart(&whole);
    for (int i = 0; i < 1000; i++) append64(&some, 1);
    for (size_t k = 0; k < 4; k++)
        for (size_t i = 0; i < sizeof claims / sizeof *claims; i++) {
            vg_bytes b = {0};
            put_file_header(&b);
            for (size_t j = 0; j < p.n && k == 3 && strcmp(p.at[j].tag, "FRAM"); j++)
                put_record(&b, p.at[j].tag, p.at[j].flags, &p.at[j].payload);
            put_record_claiming(&b, tags[k], CRITICAL, &some, claims[i]);
            int want = claims[i] > (uint64_t)1 << 40 ? VG_EINPUT : VG_ETRUNC;
            CHECK(read_in_small_memory(&b, false) == want);
            CHECK(read_in_small_memory(&b, true) == want);
            vg_bytes_clear(&b);
        }
    drop(&p);
    vg_bytes_clear(&some);
    vg_bytes_clear(&whole);
    content_clear(&c);
}

/* Records of a right length, with counts inside that do not fit. */
static void test_lying_counts(void)
{
    static const uint64_t counts[] = {(uint64_t)1 << 31, UINT32_MAX - 1,    UINT32_MAX,        (uint64_t)1 << 32,
                                      (uint64_t)1 << 61, (uint64_t)1 << 62, (uint64_t)1 << 63, UINT64_MAX};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        for (int what = 0; what < 13; what++) {
            static const char *const tags[] = {"REFP", "REFP", "REFP", "REFP", "TEXC", "PROV", "CORR",
                                               "LABL", "SELE", "LINK", "SKEL", "RIG ", "MAP "};
            vg_bytes b = {0}, mesh = {0}, x = {0};
            uint64_t n = counts[i];
            put_file_header(&b);
            append64(&mesh, what == 1 ? n : 20); /* vertices, of which a face of 17 is made */
            append64(&mesh, what == 2 ? n : 1);
            append32(&mesh, 0), append32(&mesh, what == 3 ? (uint32_t)(n >> (n > UINT32_MAX ? 32 : 0)) : 17);
            for (uint32_t k = 0; k < 18; k++) append32(&mesh, k < 17 ? k : 0);
            const char *tag = tags[what];
            for (int k = 0; k < 6 && what == 6; k++) append64(&x, k == 4 ? n : 1);
            if (what == 4) append64(&x, 3);
            if (what == 6) append32(&x, 0), append32(&x, UINT32_MAX);
            else append64(&x, what < 4 && what ? 0 : n);
            for (int k = 0; k < 10 && what >= 5 && what != 6; k++) append64(&x, what == 12 || k == 0 ? n : 0);
            put_record(&b, "MESH", CRITICAL, &mesh);
            put_record(&b, tag, 0, &x);
            put_end(&b);
            if (read_in_small_memory(&b, false) != VG_EINPUT)
                printf("%d, count %llx:\n", what, (unsigned long long)n);
            CHECK(read_in_small_memory(&b, false) == VG_EINPUT);
            vg_bytes_clear(&b);
            vg_bytes_clear(&mesh);
            vg_bytes_clear(&x);
        }
    /* the count of FORM, with a frame that has nothing */
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        vg_bytes b = {0}, form = {0}, frame = {0};
        put_file_header(&b);
        append_text(&form, "transforms"), append_text(&form, "transform");
        append64(&form, 7), append64(&form, counts[i]), append64(&form, i % 2 ? 4 : 8);
        append64(&frame, 0), append64(&frame, 0);
        put_record(&b, "FORM", CRITICAL, &form);
        put_record(&b, "FRAM", CRITICAL, &frame);
        put_end(&b);
        CHECK(read_in_small_memory(&b, false) == VG_EINPUT);
        vg_bytes_clear(&b);
        vg_bytes_clear(&form);
        vg_bytes_clear(&frame);
    }
}

/* ---- from a descriptor ---- */

typedef struct dripping {
    int fd;
    const vg_bytes *b;
    size_t piece, most;
} dripping;

static void *drip(void *context)
{
    dripping *d = context;
    for (size_t at = 0; at < d->most;) {
        size_t n = d->most - at < d->piece ? d->most - at : d->piece;
        ssize_t done = write(d->fd, d->b->data + at, n);
        if (done <= 0) break;
        at += (size_t)done;
    }
    close(d->fd);
    return NULL;
}

static int read_pipe(const vg_bytes *b, size_t piece, size_t most, content *c, vg_err *e)
{
    int fd[2];
    pthread_t thread;
    vg_reader *reader = NULL;
    if (pipe(fd) < 0) abort();
    dripping d = {fd[1], b, piece, most};
    if (pthread_create(&thread, NULL, drip, &d)) abort();
    int r = vg_reader_open(&reader, fd[0], "in.vgs", e);
    if (r == VG_OK) r = read_rest(reader, c, e);
    vg_reader_close(&reader);
    CHECK(fcntl(fd[0], F_GETFD) >= 0); /* the descriptor was lent */
    char left;
    while (read(fd[0], &left, 1) > 0) continue;
    pthread_join(thread, NULL);
    close(fd[0]);
    return r;
}

static void test_descriptor(void)
{
    static const size_t pieces[] = {1, 7, 33, 4096, 1u << 20};
    content c = make(VG_DEFORMATIONS, VG_F32, FULL);
    vg_bytes b = written(&c);
    vg_err memory = {0, ""}, piped = {0, ""};
    for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++) {
        content back = {0};
        CHECK(read_pipe(&b, pieces[i], b.size, &back, &piped) == 0);
        CHECK(same_content(&c, &back));
        content_clear(&back);
    }
    /* cut, it says the same wherever it comes from */
    for (size_t most = 0; most < b.size; most += most < 64 ? 1 : 41) {
        int want = read_memory(b.data, most, NULL, &memory);
        CHECK(read_pipe(&b, 29, most, NULL, &piped) == want && want == VG_ETRUNC);
        CHECK_TEXT(piped.message, memory.message);
    }
    for (size_t at = 0; at < b.size; at += 97) {
        if (at >= 8 && at < 12) continue;
        b.data[at] ^= 0x55;
        int want = read_memory(b.data, b.size, NULL, &memory);
        CHECK(read_pipe(&b, 29, b.size, NULL, &piped) == want && want < 0);
        CHECK_TEXT(piped.message, memory.message);
        b.data[at] ^= 0x55;
    }
    vg_bytes_clear(&b);
    content_clear(&c);
}

/* A stream of many megabytes, so that buffers are filled and refilled. */
static void test_large(void)
{
    content c = {.head = new_shape(), .n = 2};
    vg_err e = {0, ""};
    for (int i = 0; i < 150000; i++) add_vertex(&c.head, i, noise(), noise());
    for (size_t i = 0; i < c.n; i++) {
        if (vg_frame_shape(&c.frame[i], &c.head, &e) < 0) abort();
        for (size_t k = 0; k < 3 * c.head.count; k++) c.frame[i].values[k] = noise();
    }
    vg_bytes b = written(&c);
    content back = {0};
    CHECK(b.size > 10000000 && read_pipe(&b, 100000, b.size, &back, &e) == 0);
    CHECK(same_content(&c, &back));
    content_clear(&back);
    vg_bytes_clear(&b);
    content_clear(&c);
}

/* ---- failure is passed on ---- */

static void test_abandon(void)
{
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    for (size_t frames = 0; frames < 2; frames++) {
        int fd = memfd_create("stream", 0);
        vg_writer *w = NULL;
        vg_err e = {0, ""};
        CHECK(vg_writer_open(&w, fd, "out", &c.head, &e) == VG_OK);
        if (frames) CHECK(vg_writer_put(w, &c.frame[0], &e) == VG_OK);
        vg_writer_abandon(w, "vg-solve", 3, "the matrix is gone");
        vg_writer_close(&w);
        off_t size = lseek(fd, 0, SEEK_END);
        unsigned char *data = room((size_t)size, 1);
        CHECK(pread(fd, data, (size_t)size, 0) == size);
        CHECK(read_memory(data, (size_t)size, NULL, &e) == VG_ETRUNC);
        CHECK_TEXT(e.message, "'in.vgs' was cut short: vg-solve failed with status 3: the matrix is gone");
        free(data);
        close(fd);
    }
    content_clear(&c);
}

/* Counts that are out of range whatever their arrays hold; a file of such a size is no test. */
static void test_count_ranges(void)
{
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    vg_err e = {0, ""};
    vg_signal s = {.n = (1 << 20) + 1, .space = VG_SPACE_VERTICES, .d = 3 * c.head.body.mesh.nv, .l = 1, .k = 4, .bits = 64};
    CHECK(vgi_check_signal(&c.head, &s, "SIGN", &e) == VG_EINPUT && strstr(e.message, "too many frames"));
    vg_network n = {.model = VG_NETWORK_PCA, .parts = 1, .width = 9, .numbers = (1 << 27) - 1, .rank = (1 << 27) - 1,
                    .layers = 1, .hidden = 1, .sets = 1, .step = 1};
    CHECK(vgi_check_network(&c.head, &n, "NETW", &e) == VG_EINPUT && strstr(e.message, "too many numbers"));
    n.hidden = 4096, n.layers = 8, n.numbers = --n.rank;
    CHECK(vgi_check_network(&c.head, &n, "NETW", &e) == VG_EINPUT && strstr(e.message, "not those of its layers"));
    content_clear(&c);
}

static void test_full_device(void)
{
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    int fd = open("/dev/full", O_WRONLY);
    vg_writer *w = NULL;
    vg_err e = {0, ""};
    CHECK(fd >= 0 && vg_writer_open(&w, fd, "the disk", &c.head, &e) == VG_ESYS && !w &&
          strstr(e.message, "'the disk'"));
    close(fd);
    content_clear(&c);
}

/* ---- frames that are collected ---- */

static int64_t bytes_of(int fd)
{
    return (int64_t)lseek(fd, 0, SEEK_END);
}

static void test_collected(void)
{
    content c = make(VG_VERTICES, VG_F64, PLAIN);
    int fd = memfd_create("stream", 0), held = 0;
    vg_writer *w = NULL;
    vg_err e = {0, ""};
    CHECK(vg_writer_open(&w, fd, "out", &c.head, &e) == VG_OK);
    int64_t head = bytes_of(fd), frame = 0;
    CHECK(head > 0); /* whoever reads can begin */
    for (int i = 0; i < 100; i++) { /* one that comes late, which is written as it comes, and one right after it */
        nanosleep(&(struct timespec){.tv_nsec = 1500000}, NULL);
        int64_t before = bytes_of(fd);
        CHECK(vg_writer_put(w, &c.frame[0], &e) == VG_OK);
        int64_t late = bytes_of(fd);
        if (!frame) frame = late - before;
        CHECK(frame > 0 && late == before + frame);
        CHECK(vg_writer_put(w, &c.frame[0], &e) == VG_OK);
        held += bytes_of(fd) == late;
        CHECK(vg_writer_flush(w, &e) == VG_OK && bytes_of(fd) == late + frame);
    }
    CHECK(held > 0);
    CHECK(vg_writer_flush(w, &e) == VG_OK && bytes_of(fd) == head + 200 * frame);
    for (int i = 0; i < 10; i++) CHECK(vg_writer_put(w, &c.frame[0], &e) == VG_OK);
    vg_writer_abandon(w, "vg-solve", 3, "the matrix is gone"); /* after the frames */
    CHECK(bytes_of(fd) > head + 210 * frame);
    vg_writer_close(&w);
    close(fd);
    content_clear(&c);
}

TESTS({"every kind there and back", test_there_and_back}, {"extreme numbers", test_numbers},
      {"every prefix and every changed byte is refused", test_damage},
      {"nothing may follow the end", test_behind_the_end}, {"the END mark counts", test_end_mark},
      {"which record where", test_order}, {"unknown records", test_unknown},
      {"the reader takes finite numbers only", test_not_finite_in}, {"the writer, too", test_not_finite_out},
      {"lengths that lie cost no memory", test_lying_lengths}, {"counts that lie", test_lying_counts},
      {"from a descriptor in pieces", test_descriptor}, {"many megabytes", test_large},
      {"counts out of range", test_count_ranges}, {"a failure is passed on", test_abandon}, {"a full device", test_full_device},
      {"frames that are collected", test_collected})
