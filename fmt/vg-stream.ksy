# The vg stream for Kaitai Struct: what STREAM.md says, but for what it checks (checksums, ranges, order of records).
# SPDX-License-Identifier: GPL-3.0-or-later
meta:
  id: vg_stream
  title: vg stream, major version 1
  file-extension: vgs
  license: GPL-3.0-or-later
  ks-version: 0.9
  endian: le
doc: |
  A mesh, its reference pose and a sequence of frames of one form (vertices, vectors, deformations, transforms, ...):
  a file header, then records of tag, flags, length, checksums and payload, up to the END record.
doc-ref: STREAM.md
seq:
  - id: file_header
    type: file_header
  - id: head
    type: record
    repeat: until
    repeat-until: _.tag == "FORM" or _.tag == "FAIL"
    doc: everything before the frames; the last one is FORM
  - id: body
    type: record
    repeat: until
    repeat-until: _.tag == "END " or _.tag == "FAIL"
    if: head.last.tag == "FORM"
    doc: frames and unknown records; the last one is END, or FAIL when the writer failed
instances:
  form:
    value: head.last.payload.as<form>
    if: head.last.tag == "FORM"
enums:
  label_kind:
    1: object
    2: group
    3: material
    4: smoothing
    5: library
types:
  file_header:
    seq:
      - id: magic
        contents: [0x89, 0x56, 0x47, 0x53, 0x0d, 0x0a, 0x1a, 0x31]
      - id: minor
        type: u4
      - id: reserved
        contents: [0, 0, 0, 0]
  record:
    seq:
      - id: tag
        type: str
        size: 4
        encoding: ASCII
      - id: flags
        type: u4
      - id: len_payload
        type: u8
      - id: payload_sum
        type: u8
        doc: XXH64, seed 0, of the payload
      - id: header_sum
        type: u8
        doc: XXH64, seed 0, of the 24 bytes before
      - id: payload
        size: len_payload
        type:
          switch-on: tag
          cases:
            '"PROV"': prov
            '"MESH"': mesh
            '"TEXC"': texc
            '"LABL"': labl
            '"ASST"': asst
            '"SELE"': indices
            '"LINK"': link
            '"ANCH"': indices
            '"REFP"': refp
            '"SKEL"': skel
            '"CORR"': corr
            '"PTCH"': ptch
            '"RIG "': rig
            '"SKIN"': skin
            '"MAP "': map
            '"SIGN"': sign
            '"NETW"': netw
            '"FORM"': form
            '"FRAM"': fram
            '"FAIL"': fail
            '"END "': end_mark
      - id: padding
        size: (8 - len_payload % 8) % 8
    instances:
      critical:
        value: (flags & 1) != 0
      copy_safe:
        value: (flags & 2) != 0
  text:
    seq:
      - id: len
        type: u8
      - id: text
        type: str
        size: len
        encoding: UTF-8
      - id: padding
        size: (8 - len % 8) % 8
    -webide-representation: '{text}'
  list_u4:
    params:
      - id: num
        type: u8
    seq:
      - id: at
        type: u4
        repeat: expr
        repeat-expr: num
      - id: padding
        size: (num % 2) * 4
  list_u1:
    params:
      - id: num
        type: u8
    seq:
      - id: at
        type: u1
        repeat: expr
        repeat-expr: num
      - id: padding
        size: (8 - num % 8) % 8
  point:
    seq:
      - id: x
        type: f8
      - id: y
        type: f8
      - id: z
        type: f8
  prov:
    seq:
      - id: num_parents
        type: u8
      - id: num_args
        type: u8
      - id: parents
        type: list_u4(num_parents)
        doc: positions among the PROV records
      - id: program
        type: text
      - id: version
        type: text
      - id: args
        type: text
        repeat: expr
        repeat-expr: num_args
  mesh:
    seq:
      - id: num_vertices
        type: u8
      - id: num_faces
        type: u8
      - id: starts
        type: list_u4(num_faces + 1)
        doc: where each face begins in vertices, and where the last one ends
      - id: vertices
        type: list_u4(starts.at[num_faces].as<u8>)
        doc: the vertices of all faces, one face after the other
  texc:
    seq:
      - id: dimension
        type: u8
      - id: num_coordinates
        type: u8
      - id: coordinates
        type: f8
        repeat: expr
        repeat-expr: num_coordinates * dimension
      - id: corners_and_padding
        type: u4
        repeat: eos
        doc: one for each corner of the mesh, then a zero if their number is odd; 0xffffffff is none
  labl:
    seq:
      - id: num_labels
        type: u8
      - id: faces
        type: u8
        repeat: expr
        repeat-expr: num_labels
        doc: a label holds from this face on
      - id: kinds
        type: list_u4(num_labels)
        doc: see label_kind
      - id: texts
        type: text
        repeat: expr
        repeat-expr: num_labels
  asst:
    seq:
      - id: num_vertices
        type: u8
        doc: of the file that the asset is from
      - id: mesh_digest
        type: u8
      - id: len_data
        type: u8
      - id: vertices
        type: list_u4(num_vertices)
        doc: the vertex of the mesh that each vertex of the file is
      - id: data
        size: len_data
        doc: a GLB
      - id: padding
        size: (8 - len_data % 8) % 8
  indices:
    seq:
      - id: num
        type: u8
      - id: list
        type: list_u4(num)
  link:
    seq:
      - id: num
        type: u8
      - id: vertices
        type: list_u4(2 * num)
        doc: two of each link
  refp:
    seq:
      - id: name
        type: text
      - id: positions
        type: point
        repeat: eos
  skel:
    doc: joint j is vertex j of the mesh
    seq:
      - id: num_joints
        type: u8
      - id: parents
        type: list_u4(num_joints)
        doc: 0xffffffff is a root
      - id: num_channels
        type: list_u4(num_joints)
      - id: channels
        type: list_u1(6 * num_joints)
        doc: 6 of each joint; 1 2 3 x y z position, 4 5 6 x y z rotation, 0 behind the last
      - id: offsets
        type: point
        repeat: expr
        repeat-expr: num_joints
      - id: names
        type: text
        repeat: expr
        repeat-expr: num_joints
  corr:
    seq:
      - id: source
        type: end
      - id: target
        type: end
      - id: first
        type: list_u4(target.num_faces + 1)
      - id: source_faces
        type: list_u4(num_pairs)
      - id: weights
        type: f8
        repeat: expr
        repeat-expr: num_pairs
      - id: distances
        type: f8
        repeat: expr
        repeat-expr: target.num_faces
      - id: matched
        type: list_u1(target.num_faces)
    instances:
      num_pairs:
        value: first.at[target.num_faces].as<u8>
    types:
      end:
        seq:
          - id: num_vertices
            type: u8
          - id: num_faces
            type: u8
          - id: digest
            type: u8
  rig:
    seq:
      - id: num_joints
        type: u8
      - id: parents
        type: list_u4(num_joints)
        doc: 0xffffffff is a root
      - id: num_channels
        type: list_u4(num_joints)
      - id: channels
        type: list_u1(6 * num_joints)
        doc: 6 of each joint; 1 2 3 x y z position, 4 5 6 x y z rotation, 0 behind the last
      - id: offsets
        type: point
        repeat: expr
        repeat-expr: num_joints
      - id: names
        type: text
        repeat: expr
        repeat-expr: num_joints
      - id: positions
        type: point
        repeat: expr
        repeat-expr: num_joints
      - id: turns
        type: f8
        repeat: expr
        repeat-expr: 4 * num_joints
  skin:
    seq:
      - id: bones_and_weights
        size-eos: true
        doc: of each vertex 4 bones (u4), then of each vertex 4 weights (f8)
  ptch:
    seq:
      - id: num_patches
        type: u8
      - id: patches_and_padding
        type: u4
        repeat: eos
        doc: one for each face, then a zero if their number is odd
  map:
    seq:
      - id: num_transforms
        type: u8
      - id: num_vertices
        type: u8
      - id: num_hinges
        type: u8
      - id: num_corners
        type: u8
      - id: num_held
        type: u8
      - id: kind
        type: u8
        doc: 1 patches, 2 bones
      - id: has_home
        type: u8
      - id: num_names
        type: u8
      - id: per_corner
        type: u8
      - id: size
        type: f8
      - id: weights
        type: f8
        repeat: expr
        repeat-expr: num_vertices * 4 * num_transforms
      - id: place
        type: f8
        repeat: expr
        repeat-expr: 3 * num_transforms * num_transforms
      - id: centre
        type: point
        repeat: expr
        repeat-expr: num_transforms
      - id: home_centre
        type: point
        repeat: expr
        repeat-expr: num_transforms
      - id: share
        type: f8
        repeat: expr
        repeat-expr: num_transforms
      - id: home
        type: point
        repeat: expr
        repeat-expr: has_home * num_vertices
      - id: hinge_positions
        type: point
        repeat: expr
        repeat-expr: num_hinges
      - id: hinge_weights
        type: f8
        repeat: expr
        repeat-expr: num_hinges
      - id: corners
        type: f8
        repeat: expr
        repeat-expr: 4 * per_corner * num_corners
      - id: held_positions
        type: point
        repeat: expr
        repeat-expr: 'kind == 1 ? num_held : 0'
      - id: hinges
        type: list_u4(2 * num_hinges)
      - id: held_vertices
        type: list_u4(num_held)
      - id: held_patches
        type: 'list_u4(kind == 1 ? num_held : 0)'
      - id: corner_bones
        type: 'list_u4(kind == 2 ? per_corner * num_corners : 0)'
      - id: names
        type: text
        repeat: expr
        repeat-expr: num_names
  sign:
    seq:
      - id: num_frames
        type: u8
      - id: space
        type: u8
      - id: dimension
        type: u8
      - id: num_coordinates
        type: u8
      - id: num_sites
        type: u8
      - id: num_controls
        type: u8
      - id: basis_bits
        type: u8
      - id: has_root
        type: u8
      - id: has_times
        type: u8
      - id: of_examples
        type: u8
      - id: num_turns
        type: u8
      - id: layout
        type: u8
      - id: layout_and_errors
        type: f8
        repeat: expr
        repeat-expr: 6
      - id: mean
        type: f8
        repeat: expr
        repeat-expr: dimension
      - id: rest
        size-eos: true
        doc: basis, coordinates, positions, sites, parameters, knots, control points, root, turns, times, names (STREAM.md 3.20)
  netw:
    seq:
      - id: model
        type: u8
        doc: 1 auto, 2 pca, 3 fc, 4 conv
      - id: direction
        type: u8
        doc: 0 shared, 1 separate, 2 forward
      - id: mesh_digest
        type: u8
      - id: data_digest
        type: u8
      - id: num_vertices
        type: u8
      - id: num_parts
        type: u8
      - id: width
        type: u8
      - id: frame_numbers
        type: u8
      - id: rank
        type: u8
      - id: layers
        type: u8
      - id: hidden
        type: u8
      - id: convolutions
        type: u8
      - id: uncertain
        type: u8
      - id: num_sets
        type: u8
      - id: num_parameters
        type: u8
        doc: of each set
      - id: training
        type: u8
        repeat: expr
        repeat-expr: 5
        doc: seed, frames, iterations, step, windows
      - id: is_open
        type: u8
      - id: phase
        type: u8
      - id: best_iteration
        type: u8
      - id: curve_length
        type: u8
      - id: curve_block
        type: u8
      - id: numbers
        type: f8
        repeat: expr
        repeat-expr: 10
        doc: best error, curve start, diagonal, low (2), high (2), change, ridge, damping
      - id: errors
        type: f8
        repeat: expr
        repeat-expr: 30
      - id: mean
        type: f8
        repeat: expr
        repeat-expr: num_vertices * width
      - id: scale
        type: f8
        repeat: expr
        repeat-expr: 2 * rank
      - id: range
        type: f8
        repeat: expr
        repeat-expr: 2 * rank
      - id: regression
        type: f8
        repeat: expr
        repeat-expr: "model == 1 ? 2 * (3 * rank * rank + 2 * rank) : 0"
      - id: root
        type: f8
        repeat: expr
        repeat-expr: 3 * (2 * rank + 1) * (num_parts + 1)
      - id: rest
        size-eos: true
        doc: parameters, basis, curve, moments, best, each an array of f4 with its padding (STREAM.md 3.21)
  form:
    seq:
      - id: name
        type: text
        doc: vertices, vectors, deformations, transforms, features, coordinates, or another
      - id: element
        type: text
      - id: width
        type: u8
        doc: numbers of an element
      - id: count
        type: u8
        doc: elements of a frame
      - id: precision
        type: u8
        doc: 4 binary32, 8 binary64
  fram:
    seq:
      - id: name
        type: text
      - id: num_channels
        type: u8
      - id: channels
        type: channel
        repeat: expr
        repeat-expr: num_channels
      - id: values
        type:
          switch-on: _root.form.precision
          cases:
            4: f4
            8: f8
        repeat: expr
        repeat-expr: _root.form.count * _root.form.width
      - id: padding
        size: (8 - _root.form.count * _root.form.width * _root.form.precision % 8) % 8
  channel:
    seq:
      - id: name
        type: text
      - id: unit
        type: text
      - id: element
        type: text
        doc: vertex, corner, joint, anchor, transform, frame, component, vertex list, or another
      - id: width
        type: u8
      - id: count
        type: u8
      - id: type
        type: u8
        doc: 1 u4 (vertices of a list), 4 f4, 8 f8
      - id: numbers
        type:
          switch-on: type
          cases:
            1: u4
            4: f4
            8: f8
        repeat: expr
        repeat-expr: count * width
      - id: padding
        size: (8 - count * width * len_number % 8) % 8
    instances:
      len_number:
        value: 'type == 8 ? 8 : 4'
  fail:
    seq:
      - id: exit_status
        type: u8
      - id: program
        type: text
      - id: message
        type: text
  end_mark:
    seq:
      - id: num_records
        type: u8
        doc: before this one
      - id: running_sum
        type: u8
        doc: XXH64, seed 0, over the header_sum of all records before
