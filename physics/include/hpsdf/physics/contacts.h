#pragma once
// Contacts between two bodies: the surface samples of one body that lie in the other body. Each contact has
// a position, a depth, and a direction out of the other body.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/physics/field_collider.h"
#include "hpsdf/physics/surface_samples.h"

namespace hpsdf::physics {

struct ContactOptions {
  double margin = 0;  ///< samples up to this distance outside the body are contacts too; world units, 0 or more
  /// The maximum number of contacts. The deepest contacts are kept, the deepest first; among equal depths the contact
  /// with the lower sample index comes first. Without a maximum, all contacts are returned in the order of the samples.
  std::optional<std::size_t> deepest = {};
};

struct Contact {
  std::uint32_t sample;  ///< index of the sample
  double depth;          ///< minus the field value at the sample: above 0 inside
  Vector3 position;      ///< position of the sample, in the world
  /// Unit vector in world coordinates that points out of the field's body: the direction of the field's
  /// gradient. If the gradient vanishes, it is the opposite of the sample's normal.
  Vector3 normal;
};

/// The samples of one body and the field of another. All lengths have the same unit; transforms are rigid motions.
struct BodyPair {
  const SurfaceSamples* samples;
  Eigen::Isometry3d worldFromSamples;
  const FieldCollider* field;
  Eigen::Isometry3d worldFromField;
};

/// The work that contact queries took.
struct QueryCost {
  std::size_t spheres = 0;      ///< bounding spheres of samples tested against the field's lower bounds
  std::size_t samples = 0;      ///< samples tested against the field's lower bounds
  std::size_t evaluations = 0;  ///< evaluations of the field

  QueryCost& operator+=(const QueryCost& other);
};

class PairContacts;

/// Finds the contacts of one body pair at a time. It reuses its memory, so that a query allocates memory
/// only if it has more contacts than every query before.
class ContactQuery {
 public:
  /// Returns the contacts of a pair: exactly those that evaluating the field at every sample would give. The
  /// result is valid until the next query. Throws `Error` if a transform is not finite or not rigid (within
  /// 1e-6), if the margin is not finite or below 0, and if `deepest` is 0.
  std::span<const Contact> find(const BodyPair& pair, const ContactOptions& options = {});

  /// The cost of the last query.
  const QueryCost& cost() const { return cost_; }

 private:
  friend void findContacts(std::span<const BodyPair> pairs, const ContactOptions& options, PairContacts& out);

  void clear();
  /// Appends the contacts of a valid pair to `contacts_`, and adds the work of the query to `cost_`.
  void append(const BodyPair& pair, const ContactOptions& options);

  std::vector<Contact> contacts_;
  QueryCost cost_;
};

/// The contacts of many pairs, in memory that the next search reuses.
class PairContacts {
 public:
  std::size_t pairs() const { return pairs_; }
  std::span<const Contact> of(std::size_t pair) const;
  std::span<const Contact> all() const { return contacts_; }  ///< contacts of all pairs, in the order of the pairs
  const QueryCost& cost() const { return cost_; }             ///< total cost of the last search

 private:
  friend void findContacts(std::span<const BodyPair> pairs, const ContactOptions& options, PairContacts& out);

  std::size_t pairs_ = 0;
  std::vector<ContactQuery> blocks_;  ///< contacts of consecutive pairs, one element for each task
  std::vector<std::size_t> ends_;     ///< index in contacts_ after each pair's last contact
  std::vector<Contact> contacts_;
  QueryCost cost_;
};

/// Finds the contacts of all pairs, as `ContactQuery` does, with the threads of the caller's TBB arena. The
/// result does not depend on the number of threads. Throws `Error` as `ContactQuery` does, before any query
/// starts, and names the number of the first invalid pair.
void findContacts(std::span<const BodyPair> pairs, const ContactOptions& options, PairContacts& out);

}  // namespace hpsdf::physics
