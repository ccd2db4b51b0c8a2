#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "hpsdf/build_options.h"
#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf {

/// Checks the arguments of `build`, which calls this function first. Throws `Error` (of the kind `option`) for the
/// first setting that is out of range and for a domain that is empty, flat or not finite, and `MemoryLimitError` for a
/// base grid that does not fit into memory.
void checkBuild(const Box& domain, const BuildOptions& options);

/// A function that is offered the field of a construction while this grows, for instance to show it. It may call
/// `fieldSoFar` to make a field of the present state, or decline: a field takes time and memory, which is not counted
/// in `BuildOptions::memoryLimit`. The field has rounded coefficients. It is not pruned, enriched or made weakly
/// continuous, and has no bounds.
using OfferField = std::function<void(const std::function<Field()>& fieldSoFar)>;

/// Builds a field that approximates the signed distance Φ over `domain`. The field's metadata stores the description of
/// Φ (`DistanceFunction::source`). If this description contains the surface's bounding box, the longest side of the box
/// is the length L that scales the target error (see `BuildOptions::targetError`).
///
/// If `offer` is not empty, it is called after each round of refinement steps; it does not affect the result. While
/// memory is short, and by a construction within a tolerance, it is not called.
///
/// Throws `Error` for options or a domain out of range, for an octree that would not fit into memory (the message says
/// how much memory it would need), and if Φ returns a value that is not finite. Throws `Cancelled` when `progress` says
/// so, and rethrows exceptions of `offer`.
Field build(const DistanceFunction& distance, const Box& domain, const BuildOptions& options = {},
            const Progress& progress = {}, const OfferField& offer = {});

/// Builds several fields in one construction: one for each number in `steps`, which must be in non-descending order.
/// For each number, `visit` receives the field that `build` returns with this number as `maxSteps`. The construction
/// continues only after `visit` has returned. Throws as `build` does. Also throws `Error` if `steps` descend, and
/// rethrows exceptions of `visit`.
void buildStages(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                 std::span<const std::uint64_t> steps, const std::function<void(Field)>& visit,
                 const Progress& progress = {});

/// Builds the same field as `build`, bit for bit, but resumes an interrupted construction from `checkpoint.file` if
/// this file exists. The result does not depend on when earlier processes were stopped or on how many threads they
/// used. The file holds the octree while it is refined; the stages after refinement, such as pruning, are repeated. The
/// caller should remove the file once the field is saved.
///
/// Throws as `build` does. Also throws `Error`, before anything is built, if the file cannot be written, is damaged, or
/// was begun by another version of the program or with another Φ, domain or options (`threads` and `memoryLimit` may
/// differ). Two Φ count as the same if their sources and their values at 4096 points agree.
Field buildResumably(const DistanceFunction& distance, const Box& domain, const BuildOptions& options,
                     const Checkpoint& checkpoint, const Progress& progress = {});

struct RebuildOptions {
  std::optional<std::uint64_t> memoryLimit = {};  ///< as `BuildOptions::memoryLimit`
  int threads = 0;  ///< greatest number of threads, up to 1024; 0: all of the machine. It does not affect the result.
};

/// A field of a changed mesh, and how much of the earlier field it contains.
struct RebuiltField {
  Field field;
  std::uint64_t changedTriangles = 0;  ///< triangles that only one of the two meshes has
  std::uint64_t leaves = 0;            ///< number of leaves of the earlier field
  std::uint64_t kept = 0;              ///< number of its leaves that are leaves of the new field, too
  double keptVolume = 0;               ///< their share of the domain's volume
  /// True if no leaf was kept because signs may change everywhere: the inside test is another one; or signs come from
  /// winding numbers, and one of the meshes has holes, or the sign of its volume (`signedVolume`) changes.
  bool signsChange = false;
};

/// Builds the field of a mesh that differs from the mesh of an earlier field in some triangles. Leaves of the earlier
/// field which no changed triangle can reach keep the coefficients of their polynomials, to the bit, or their lists of
/// triangles. The other parts of the octree are built anew, with the settings of the earlier field and its length L.
/// The new cells may have the part of the target error that the kept leaves do not use. The errors of leaves are not
/// stored; their shares are those of the embedded estimate. New cells may have 2 % of the target error in any case, so
/// that each update may exceed the target error by 2 %. If the earlier construction ended above its target error, the
/// error that it reached is aimed at instead.
///
/// Triangles are the same if their corners are, whatever their indices; moving, adding and removing triangles are
/// alike. If more than half of the triangles differ, the whole field is built anew. For equal meshes the result is the
/// earlier field with the name and the fingerprint of the new mesh.
///
/// `before` is the mesh of the earlier field, and `after` the mesh to which `distance` measures, for instance an
/// `ExactDistance`. Both are in the units of the field. The metadata of the new field has the number of evaluations of
/// `distance`, but no number of steps and no measured errors.
///
/// Throws `Error` if `before` is not the mesh of the earlier field, if `distance` measures to another mesh than
/// `after`, if `after` leaves the domain, for outer hulls, and for a field that was built within a tolerance, within a
/// limit of bytes, or with weak continuity, because its cells depend on each other. Throws as `build` does.
RebuiltField rebuild(const Field& field, const TriangleMesh& before, const TriangleMesh& after,
                     const DistanceFunction& distance, const RebuildOptions& options = {},
                     const Progress& progress = {});

}  // namespace hpsdf
