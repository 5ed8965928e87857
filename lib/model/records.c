/* records.c: the table of header records; artefact.h says how to add one. It is used in artefact.c and
 * io/artefact_io.c; contents are checked in checks.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/artefact.h"

#define SIZE_OF(type, member) sizeof(((type *)0)->member)
#define NUMBER(struct_type, stream_type, member) \
    {.type = VGI_##stream_type, .at = offsetof(struct_type, member), .size = SIZE_OF(struct_type, member)}
#define ARRAY(struct_type, stream_type, member, entry_width, how_many)                                              \
    {.type = VGI_##stream_type, .at = offsetof(struct_type, member), .size = sizeof(*((struct_type *)0)->member), \
     .width = (entry_width), .length = (how_many)}
#define OPTIONAL(struct_type, stream_type, member, entry_width, how_many)                                           \
    {.type = VGI_##stream_type, .optional = true, .at = offsetof(struct_type, member),                               \
     .size = sizeof(*((struct_type *)0)->member), .width = (entry_width), .length = (how_many)}
#define DERIVED(struct_type, member, how_many)                                                                       \
    {.type = VGI_U32, .derived = true, .at = offsetof(struct_type, member),                                          \
     .size = sizeof(*((struct_type *)0)->member), .width = 1, .length = (how_many)}
#define DERIVED_NUMBER(struct_type, member) \
    {.type = VGI_U64, .derived = true, .at = offsetof(struct_type, member), .size = SIZE_OF(struct_type, member)}
/* column `column` of an array of row_type */
#define COLUMN(struct_type, stream_type, member, row_type, column, entry_width, how_many)                           \
    {.type = VGI_##stream_type, .at = offsetof(struct_type, member), .size = sizeof(row_type),                       \
     .row_at = offsetof(row_type, column), .rows = true, .width = (entry_width), .length = (how_many)}

/* A function for vgi_member.length; `a` is the struct. */
#define LENGTH(function, struct_type, expression)                                                                    \
    static size_t function(const void *artefact, const vg_mesh *mesh)                                                \
    {                                                                                                                \
        const struct_type *a = artefact;                                                                             \
        (void)a, (void)mesh;                                                                                         \
        return expression;                                                                                           \
    }

static size_t checked_product(size_t a, size_t b)
{
    size_t product;
    return vgi_mul(a, b, &product) ? product : SIZE_MAX;
}

/* The last entry of a list of n + 1 starts: the length of the list that they divide. */
static size_t last_of(const uint32_t *start, size_t n)
{
    return start ? start[n] : 0;
}

static size_t one_more(size_t n)
{
    return n < SIZE_MAX ? n + 1 : n;
}

/* ---- the body ---- */

LENGTH(prov_parents, vg_provenance, a->nparents)
LENGTH(prov_args, vg_provenance, a->nargs)
static const vgi_member prov_fields[] = {
    NUMBER(vg_provenance, U64, nparents),
    NUMBER(vg_provenance, U64, nargs),
    ARRAY(vg_provenance, U32, parents, 1, prov_parents),
    NUMBER(vg_provenance, TEXT, program),
    NUMBER(vg_provenance, TEXT, version),
    ARRAY(vg_provenance, TEXT, args, 1, prov_args)};

LENGTH(mesh_starts, vg_mesh, one_more(a->nf))
LENGTH(mesh_corners, vg_mesh, last_of(a->start, a->nf))
static const vgi_member mesh_fields[] = {
    NUMBER(vg_mesh, U64, nv),
    NUMBER(vg_mesh, U64, nf),
    ARRAY(vg_mesh, U32, start, 1, mesh_starts),
    ARRAY(vg_mesh, U32, vert, 1, mesh_corners)};

LENGTH(texture_numbers, vg_attributes, checked_product(a->ntex, a->tex_dim))
LENGTH(texture_corners, vg_attributes, last_of(mesh->start, mesh->nf))
static const vgi_member texc_fields[] = {
    NUMBER(vg_attributes, U64, tex_dim),
    NUMBER(vg_attributes, U64, ntex),
    OPTIONAL(vg_attributes, F64, tex, 1, texture_numbers),
    OPTIONAL(vg_attributes, U32, corner_tex, 1, texture_corners)};

LENGTH(labels, vg_attributes, a->nlabels)
static const vgi_member labl_fields[] = {
    NUMBER(vg_attributes, U64, nlabels),
    COLUMN(vg_attributes, U64, labels, vg_label, face, 1, labels),
    COLUMN(vg_attributes, U32, labels, vg_label, kind, 1, labels),
    COLUMN(vg_attributes, TEXT, labels, vg_label, text, 1, labels)};

LENGTH(colours, vg_attributes, a->ncolours)
static const vgi_member colv_fields[] = {
    NUMBER(vg_attributes, U64, ncolours),
    ARRAY(vg_attributes, U8, colours, 4, colours)};

LENGTH(asset_vertices, vg_asset, a->n)
LENGTH(asset_bytes, vg_asset, a->size)
static const vgi_member asst_fields[] = {
    NUMBER(vg_asset, U64, n),
    NUMBER(vg_asset, U64, digest),
    NUMBER(vg_asset, U64, size),
    ARRAY(vg_asset, U32, vertex, 1, asset_vertices),
    ARRAY(vg_asset, U8, data, 1, asset_bytes)};

LENGTH(mesh_vertices, vg_body, mesh->nv)
static const vgi_member refp_fields[] = {
    NUMBER(vg_body, TEXT, reference_name),
    ARRAY(vg_body, F64, reference, 3, mesh_vertices)};

#define JOINTS(struct_type, count, rows, how_many)                            \
    NUMBER(struct_type, U64, count),                                          \
    COLUMN(struct_type, U32, rows, vg_joint, parent, 1, how_many),            \
    COLUMN(struct_type, U32, rows, vg_joint, nchannels, 1, how_many),         \
    COLUMN(struct_type, U8, rows, vg_joint, channels, 6, how_many),           \
    COLUMN(struct_type, F64, rows, vg_joint, offset, 3, how_many),            \
    COLUMN(struct_type, TEXT, rows, vg_joint, name, 1, how_many)

LENGTH(skeleton_joints, vg_skeleton, a->njoints)
static const vgi_member skel_fields[] = {JOINTS(vg_skeleton, njoints, joints, skeleton_joints)};

LENGTH(patch_faces, vg_patches, mesh->nf)
static const vgi_member ptch_fields[] = {
    NUMBER(vg_patches, U64, n),
    ARRAY(vg_patches, U32, of_face, 1, patch_faces)};

LENGTH(rig_joints, vg_rig, a->skeleton.njoints)
LENGTH(rig_bones, vg_rig, a->nbones)
static const vgi_member rig_fields[] = {
    JOINTS(vg_rig, skeleton.njoints, skeleton.joints, rig_joints),
    ARRAY(vg_rig, F64, at, 3, rig_joints),
    ARRAY(vg_rig, F64, turn, 4, rig_joints),
    DERIVED_NUMBER(vg_rig, nbones),
    DERIVED(vg_rig, bone, rig_bones)};

static const vgi_member skin_fields[] = {
    ARRAY(vg_rig, U32, skin_bone, VG_SKIN, mesh_vertices),
    ARRAY(vg_rig, F64, skin_weight, VG_SKIN, mesh_vertices)};

/* ---- beside the body ---- */

LENGTH(selected_faces, vg_head, a->selection.n)
static const vgi_member sele_fields[] = {
    NUMBER(vg_head, U64, selection.n), ARRAY(vg_head, U32, selection.faces, 1, selected_faces)};

LENGTH(link_count, vg_head, a->links.n)
static const vgi_member link_fields[] = {NUMBER(vg_head, U64, links.n), ARRAY(vg_head, U32, links.pairs, 2, link_count)};

LENGTH(anchor_count, vg_head, a->nanchors)
static const vgi_member anch_fields[] = {NUMBER(vg_head, U64, nanchors), ARRAY(vg_head, U32, anchors, 1, anchor_count)};

LENGTH(driven_starts, vg_correspondence, one_more(a->target_nf))
LENGTH(driven_faces, vg_correspondence, a->target_nf)
LENGTH(pairs, vg_correspondence, last_of(a->first, a->target_nf))
static const vgi_member corr_fields[] = {
    NUMBER(vg_correspondence, U64, source_nv),
    NUMBER(vg_correspondence, U64, source_nf),
    NUMBER(vg_correspondence, U64, source_digest),
    NUMBER(vg_correspondence, U64, target_nv),
    NUMBER(vg_correspondence, U64, target_nf),
    NUMBER(vg_correspondence, U64, target_digest),
    ARRAY(vg_correspondence, U32, first, 1, driven_starts),
    ARRAY(vg_correspondence, U32, source, 1, pairs),
    ARRAY(vg_correspondence, F64, weight, 1, pairs),
    ARRAY(vg_correspondence, F64, distance, 1, driven_faces),
    ARRAY(vg_correspondence, U8, matched, 1, driven_faces)};

LENGTH(map_weights, vg_map, checked_product(a->nv, a->n))
LENGTH(map_place, vg_map, checked_product(a->n, a->n))
LENGTH(map_transforms, vg_map, a->n)
LENGTH(map_home, vg_map, a->has_home ? a->nv : 0)
LENGTH(map_hinges, vg_map, a->nhinges)
LENGTH(map_corners, vg_map, checked_product(a->ncorners, a->per_corner))
LENGTH(map_held, vg_map, a->nheld)
LENGTH(map_placed, vg_map, a->kind == VG_MAP_BONES ? 0 : a->nheld)
LENGTH(map_corner_bones, vg_map, a->kind == VG_MAP_BONES ? checked_product(a->ncorners, a->per_corner) : 0)
LENGTH(map_names, vg_map, a->nnames)
static const vgi_member map_fields[] = {
    NUMBER(vg_map, U64, n),
    NUMBER(vg_map, U64, nv),
    NUMBER(vg_map, U64, nhinges),
    NUMBER(vg_map, U64, ncorners),
    NUMBER(vg_map, U64, nheld),
    NUMBER(vg_map, U64, kind),
    NUMBER(vg_map, U64, has_home),
    NUMBER(vg_map, U64, nnames),
    NUMBER(vg_map, U64, per_corner),
    NUMBER(vg_map, F64, size),
    OPTIONAL(vg_map, F64, weights, 4, map_weights),
    OPTIONAL(vg_map, F64, place, 3, map_place),
    OPTIONAL(vg_map, F64, centre, 3, map_transforms),
    OPTIONAL(vg_map, F64, home_centre, 3, map_transforms),
    OPTIONAL(vg_map, F64, share, 1, map_transforms),
    OPTIONAL(vg_map, F64, home, 3, map_home),
    OPTIONAL(vg_map, F64, hinge_at, 3, map_hinges),
    OPTIONAL(vg_map, F64, hinge_weight, 1, map_hinges),
    OPTIONAL(vg_map, F64, corner, 4, map_corners),
    OPTIONAL(vg_map, F64, held_at, 3, map_placed),
    OPTIONAL(vg_map, U32, hinge, 2, map_hinges),
    OPTIONAL(vg_map, U32, held, 1, map_held),
    OPTIONAL(vg_map, U32, held_patch, 1, map_placed),
    OPTIONAL(vg_map, U32, corner_bone, 1, map_corner_bones),
    OPTIONAL(vg_map, TEXT, names, 1, map_names)};

LENGTH(signal_frames, vg_signal, a->n)
LENGTH(signal_numbers, vg_signal, a->d)
LENGTH(signal_basis, vg_signal, a->bits == 64 ? checked_product(a->m, a->d) : 0)
LENGTH(signal_basis_single, vg_signal, a->bits == 32 ? checked_product(a->m, a->d) : 0)
LENGTH(signal_basis_short, vg_signal, a->bits == 16 ? checked_product(a->m, a->d) : 0)
LENGTH(signal_units, vg_signal, a->bits == 16 ? a->m : 0)
LENGTH(signal_coordinates, vg_signal, checked_product(a->n, a->m))
LENGTH(signal_sites, vg_signal, a->l)
LENGTH(signal_knots, vg_signal, one_more(one_more(a->k)))
LENGTH(signal_controls, vg_signal, a->k)
LENGTH(signal_roots, vg_signal, a->rooted ? a->n : 0)
LENGTH(signal_turns, vg_signal, a->nturns)
LENGTH(signal_times, vg_signal, a->timed ? a->n : 0)
static const vgi_member sign_fields[] = {
    NUMBER(vg_signal, U64, n),
    NUMBER(vg_signal, U64, space),
    NUMBER(vg_signal, U64, d),
    NUMBER(vg_signal, U64, m),
    NUMBER(vg_signal, U64, l),
    NUMBER(vg_signal, U64, k),
    NUMBER(vg_signal, U64, bits),
    NUMBER(vg_signal, U64, rooted),
    NUMBER(vg_signal, U64, timed),
    NUMBER(vg_signal, U64, examples),
    NUMBER(vg_signal, U64, nturns),
    NUMBER(vg_signal, U64, layout),
    NUMBER(vg_signal, F64, layout_weight),
    NUMBER(vg_signal, F64, layout_ratio),
    NUMBER(vg_signal, F64, error_shape),
    NUMBER(vg_signal, F64, error_pose),
    NUMBER(vg_signal, F64, error_time),
    NUMBER(vg_signal, F64, error_rms),
    ARRAY(vg_signal, F64, mean, 1, signal_numbers),
    OPTIONAL(vg_signal, F64, basis, 1, signal_basis),
    OPTIONAL(vg_signal, F32, basis_single, 1, signal_basis_single),
    OPTIONAL(vg_signal, U8, basis_short, 2, signal_basis_short),
    OPTIONAL(vg_signal, F64, basis_unit, 1, signal_units),
    ARRAY(vg_signal, F64, coordinate, 1, signal_coordinates),
    ARRAY(vg_signal, F64, position, 2, signal_frames),
    ARRAY(vg_signal, U32, site, 1, signal_sites),
    ARRAY(vg_signal, F64, parameter, 1, signal_frames),
    ARRAY(vg_signal, F64, knot, 1, signal_knots),
    ARRAY(vg_signal, F64, control, 2, signal_controls),
    OPTIONAL(vg_signal, F64, turn, 4, signal_roots),
    OPTIONAL(vg_signal, F64, shift, 3, signal_roots),
    OPTIONAL(vg_signal, F64, home_turn, 4, signal_turns),
    OPTIONAL(vg_signal, F64, times, 1, signal_times),
    ARRAY(vg_signal, TEXT, names, 1, signal_frames)};

static size_t of_network(size_t entries, const vg_network *n)
{
    return checked_product(entries, checked_product(n->sets, n->nparameters));
}

LENGTH(net_features, vg_network, checked_product(a->nv, a->width))
LENGTH(net_rank, vg_network, a->rank)
LENGTH(net_errors, vg_network, 2 * VG_NETWORK_METHODS * VG_NETWORK_FRAMES)
LENGTH(net_regression, vg_network, a->model == VG_NETWORK_AUTO ? checked_product(a->rank, one_more(one_more(checked_product(a->rank, 3)))) : 0)
LENGTH(net_root, vg_network, checked_product(one_more(checked_product(a->rank, 2)), one_more(a->parts)))
LENGTH(net_parameters, vg_network, of_network(1, a))
LENGTH(net_basis, vg_network, checked_product(a->rank, checked_product(a->nv, a->width)))
LENGTH(net_curve, vg_network, a->ncurve)
LENGTH(net_moments, vg_network, a->open ? of_network(1, a) : 0)
static const vgi_member netw_fields[] = {
    NUMBER(vg_network, U64, model),
    NUMBER(vg_network, U64, direction),
    NUMBER(vg_network, U64, mesh_digest),
    NUMBER(vg_network, U64, data_digest),
    NUMBER(vg_network, U64, nv),
    NUMBER(vg_network, U64, parts),
    NUMBER(vg_network, U64, width),
    NUMBER(vg_network, U64, numbers),
    NUMBER(vg_network, U64, rank),
    NUMBER(vg_network, U64, layers),
    NUMBER(vg_network, U64, hidden),
    NUMBER(vg_network, U64, convolutions),
    NUMBER(vg_network, U64, uncertain),
    NUMBER(vg_network, U64, sets),
    NUMBER(vg_network, U64, nparameters),
    NUMBER(vg_network, U64, seed),
    NUMBER(vg_network, U64, frames),
    NUMBER(vg_network, U64, iterations),
    NUMBER(vg_network, U64, step),
    NUMBER(vg_network, U64, windows),
    NUMBER(vg_network, U64, open),
    NUMBER(vg_network, U64, phase),
    NUMBER(vg_network, U64, best_iteration),
    NUMBER(vg_network, U64, ncurve),
    NUMBER(vg_network, U64, ncurve_block),
    NUMBER(vg_network, F64, best_error),
    NUMBER(vg_network, F64, curve_start),
    NUMBER(vg_network, F64, diagonal),
    NUMBER(vg_network, F64, low[0]),
    NUMBER(vg_network, F64, low[1]),
    NUMBER(vg_network, F64, high[0]),
    NUMBER(vg_network, F64, high[1]),
    NUMBER(vg_network, F64, change),
    NUMBER(vg_network, F64, ridge),
    NUMBER(vg_network, F64, damping),
    ARRAY(vg_network, F64, errors, 1, net_errors),
    ARRAY(vg_network, F64, mean, 1, net_features),
    ARRAY(vg_network, F64, scale, 2, net_rank),
    ARRAY(vg_network, F64, range, 2, net_rank),
    OPTIONAL(vg_network, F64, regression, 2, net_regression),
    ARRAY(vg_network, F64, root, 3, net_root),
    ARRAY(vg_network, F32, parameters, 1, net_parameters),
    ARRAY(vg_network, F32, basis, 1, net_basis),
    OPTIONAL(vg_network, F32, curve, 3, net_curve),
    OPTIONAL(vg_network, F32, moments, 2, net_moments),
    OPTIONAL(vg_network, F32, best, 1, net_moments)};

/* ---- the table ---- */

#define IN_BODY(member) .in_body = true, .at = offsetof(vg_body, member), .size = SIZE_OF(vg_body, member)
#define IN_HEAD(member) .at = offsetof(vg_head, member), .size = SIZE_OF(vg_head, member)
#define PRESENT(member) .present_at = offsetof(vg_head, member), .present_size = SIZE_OF(vg_head, member)
#define MARKED(member) PRESENT(member), .marks = true, .mark_at = offsetof(vg_head, member)
#define REPEATS(pointer, count) \
    .at = offsetof(vg_head, pointer), .each = sizeof(*((vg_head *)0)->pointer), .count_at = offsetof(vg_head, count)
#define FIELDS(list) .fields = (list), .nfields = sizeof(list) / sizeof *(list)

const vgi_artefact vgi_artefacts[VGI_ARTEFACTS] = {
    [VGI_PROV] = {.tag = "PROV", .flags = VGI_COPY_SAFE, REPEATS(provenance, nprovenance), FIELDS(prov_fields),
                  .check = vgi_check_provenance},
    [VGI_MESH] = {.tag = "MESH", .flags = VGI_CRITICAL, .name = "mesh", IN_BODY(mesh), PRESENT(body.reference),
                  FIELDS(mesh_fields), .check = vgi_check_mesh},
    [VGI_TEXC] = {.tag = "TEXC", .name = "attributes", .needs = "MESH", IN_BODY(attributes), PRESENT(body.attributes.ntex),
                  FIELDS(texc_fields), .check = vgi_check_texture},
    [VGI_LABL] = {.tag = "LABL", .name = "attributes", .needs = "MESH", IN_BODY(attributes), PRESENT(body.attributes.nlabels),
                  FIELDS(labl_fields), .check = vgi_check_labels},
    [VGI_COLV] = {.tag = "COLV", .name = "attributes", .needs = "MESH", IN_BODY(attributes), PRESENT(body.attributes.ncolours),
                  FIELDS(colv_fields), .check = vgi_check_colours},
    [VGI_ASST] = {.tag = "ASST", .name = "asset", .needs = "MESH", IN_BODY(asset), PRESENT(body.asset.n),
                  FIELDS(asst_fields), .check = vgi_check_asset},
    [VGI_SELE] = {.tag = "SELE", .flags = VGI_CRITICAL, .name = "selection", .needs = "MESH",
                  MARKED(selection.chosen), FIELDS(sele_fields),
                  .check = vgi_check_selection},
    [VGI_LINK] = {.tag = "LINK", .flags = VGI_CRITICAL, .name = "links", .needs = "MESH", MARKED(links.chosen), FIELDS(link_fields),
                  .check = vgi_check_links},
    [VGI_ANCH] = {.tag = "ANCH", .flags = VGI_CRITICAL, .name = "anchors", .needs = "MESH", PRESENT(nanchors), FIELDS(anch_fields),
                  .check = vgi_check_anchors},
    [VGI_REFP] = {.tag = "REFP", .flags = VGI_CRITICAL, .name = "reference", .needs = "MESH", .in_body = true, PRESENT(body.reference),
                  FIELDS(refp_fields)},
    [VGI_SKEL] = {.tag = "SKEL", .name = "skeleton", .needs = "MESH", IN_BODY(skeleton),
                  PRESENT(body.skeleton.njoints), FIELDS(skel_fields), .check = vgi_check_skeleton},
    [VGI_CORR] = {.tag = "CORR", .flags = VGI_CRITICAL, .name = "correspondence", .advice = "make one with vg-register",
                  IN_HEAD(correspondence), PRESENT(correspondence.first), FIELDS(corr_fields),
                  .check = vgi_check_correspondence},
    [VGI_PTCH] = {.tag = "PTCH", .name = "patches", .advice = "make them with vg-segment", .needs = "MESH",
                  IN_BODY(patches), PRESENT(body.patches.n), FIELDS(ptch_fields), .check = vgi_check_patches},
    [VGI_RIG] = {.tag = "RIG ", .name = "rig", .advice = "make one with vg-fitmap --skeleton", .needs = "MESH",
                 IN_BODY(rig), PRESENT(body.rig.skeleton.njoints), FIELDS(rig_fields), .check = vgi_check_rig},
    [VGI_SKIN] = {.tag = "SKIN", .name = "rig", .needs = "RIG ", IN_BODY(rig), PRESENT(body.rig.skin_bone), FIELDS(skin_fields),
                  .check = vgi_check_skin},
    [VGI_MAP] = {.tag = "MAP ", .flags = VGI_CRITICAL, .name = "map", .advice = "make one with vg-fitmap",
                 .needs = "MESH", IN_HEAD(map), PRESENT(map.n), FIELDS(map_fields), .check = vgi_check_map},
    [VGI_SIGN] = {.tag = "SIGN", .flags = VGI_CRITICAL, .name = "signal", .advice = "make one with vg-fitsignal",
                  .needs = "MESH", IN_HEAD(signal), PRESENT(signal.n), FIELDS(sign_fields),
                  .check = vgi_check_signal},
    [VGI_NETW] = {.tag = "NETW", .flags = VGI_CRITICAL, .name = "network", .advice = "make one with vg-train",
                  .needs = "MESH", IN_HEAD(network), PRESENT(network.model), FIELDS(netw_fields),
                  .check = vgi_check_network},
};
