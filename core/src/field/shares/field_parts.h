#pragma once
// Parts of a finished field that several processes hold.

#include <vector>

#include "hpsdf/detail/field_data.h"
#include "util/message.h"

namespace hpsdf::detail {

/// Returns a message that carries the nodes and the coefficients of a part.
Message messageOf(const FieldData& part);
/// Returns the part that a message carries, without a domain and metadata. Throws `Error` for a damaged message.
FieldData partOf(const Message& message);

/// Puts the parts of a field without exact leaves together. In each part, the leaves of the others are exact ones
/// without triangles (`layOut`). All parts have coefficients of the same type. All else is that of the first part.
FieldData putTogether(std::vector<FieldData>&& parts);

}  // namespace hpsdf::detail
