#pragma once
// The arrays of a field as compressed streams, in place of their bytes.

#include "field/io/field_sizes.h"
#include "hpsdf/detail/field_data.h"
#include "util/checked_file.h"

namespace hpsdf::io {

/// Writes all arrays of a field, compressed (docs/file-format.md).
void writeCompressed(detail::CheckedWriter& writer, const FieldData& data);

/// Reads the arrays that `writeCompressed` wrote. The rest of `data`, and `sizes`, come from the file's header. Throws
/// `Error` if the streams are damaged or do not fit the sizes or, before memory is taken, if the arrays would need more
/// memory than the process may take.
void readCompressed(detail::CheckedReader& reader, const FieldSizes& sizes, FieldData& data);

}  // namespace hpsdf::io
