#pragma once
// The samples of one body that lie in another: where, how deep, which way out.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/physics/field_collider.h"
#include "hpsdf/physics/surface_samples.h"

namespace hpsdf::physics {

struct ContactOptions {
  double margin = 0;  ///< samples that are outside by no more count too; in world units, not below 0
  /// No more than so many, the deepest ones, the deepest first and of equal ones that of the lower index. Nothing: all,
  /// in the samples' order.
  std::optional<std::size_t> deepest = {};
};

struct Contact {
  std::uint32_t sample;  ///< its index
  double depth;          ///< the field's value there, negative: above 0 inside
  Vector3 position;      ///< of the sample, in the world
  /// Unit length, in the world: the field's gradient there, out of the field's body. Where that vanishes, against the
  /// sample's own normal.
  Vector3 normal;
};

/// Samples of one body against the field of another, each in its body's own units, which are the world's. Transforms
/// are rotations and shifts.
struct BodyPair {
  const SurfaceSamples* samples;
  Eigen::Isometry3d worldFromSamples;
  const FieldCollider* field;
  Eigen::Isometry3d worldFromField;
};

/// What queries had to look at.
struct QueryCost {
  std::size_t spheres = 0;      ///< looked up in the collider's table
  std::size_t samples = 0;      ///< the same
  std::size_t evaluations = 0;  ///< of the field

  QueryCost& operator+=(const QueryCost& other);
};

/// Queries one after another: keeps the room for the contacts, so that none takes memory once there is enough.
class ContactQuery {
 public:
  /// The contacts are valid until the next query. The very samples that evaluating the field at each would find. Throws
  /// `Error` for a transform that is not finite or not rigid (by more than 1e-6), for a margin that is not finite or
  /// below 0, for no contacts to be found.
  std::span<const Contact> find(const BodyPair& pair, const ContactOptions& options = {});

  /// Of the last query.
  const QueryCost& cost() const { return cost_; }

 private:
  std::vector<Contact> contacts_;
  QueryCost cost_;
};

/// The contacts of many pairs, and room that is used again.
class PairContacts {
 public:
  std::size_t pairs() const { return pairs_; }
  std::span<const Contact> of(std::size_t pair) const;
  std::span<const Contact> all() const { return contacts_; }  ///< one pair's after another's
  const QueryCost& cost() const { return cost_; }             ///< in all

 private:
  friend void findContacts(std::span<const BodyPair> pairs, const ContactOptions& options, PairContacts& out);

  /// Pairs that one thread asks for.
  struct Block {
    std::vector<Contact> contacts;
    QueryCost cost;
  };

  std::size_t pairs_ = 0;
  std::vector<Block> blocks_;
  std::vector<std::size_t> ends_;  ///< of each pair's contacts
  std::vector<Contact> contacts_;
  QueryCost cost_;
};

/// As `ContactQuery`, by the threads of the caller's TBB arena, on which the result does not depend. Throws `Error` as
/// it does, naming the first pair that is at fault, before any is asked for.
void findContacts(std::span<const BodyPair> pairs, const ContactOptions& options, PairContacts& out);

}  // namespace hpsdf::physics
