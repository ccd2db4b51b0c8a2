#include "hpsdf/output/sample_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "arrays/npy.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/detail/text.h"
#include "util/chunks.h"
#include "util/number_text.h"

namespace hpsdf {
namespace {

enum class SampleFormat : std::uint8_t { npz, ply, csv };

constexpr std::size_t kRowsOfPiece = 8192;  ///< rows that a thread formats at a time
constexpr std::size_t kPiecesAtOnce = 64;   ///< pieces that are in memory before they are written

SampleFormat sampleFormat(const std::filesystem::path& file, const SampleFileOptions& options) {
  const std::string extension = lowerExtension(file);
  const bool known = extension == ".npz" || extension == ".ply" || extension == ".csv";
  if (!known)
    throw Error(ErrorKind::file, file.string(), "samples are written as .npz, .ply or .csv; give a name that ends so");
  if (options.layout == SampleLayout::deepSdf && extension != ".npz")
    throw Error(ErrorKind::file, file.string(), "DeepSDF's layout is one of .npz files; give a name that ends so");
  return extension == ".npz" ? SampleFormat::npz : extension == ".ply" ? SampleFormat::ply : SampleFormat::csv;
}

/// Returns numbers or vectors as one array of numbers of a type, which may be shorter than double.
template <typename Number>
std::vector<Number> numbersOf(std::span<const double> values) {
  std::vector<Number> numbers(values.size());
  detail::forEachChunk(values.size(), kRowsOfPiece, [&](std::size_t, std::size_t first, std::size_t count) {
    std::ranges::transform(values.subspan(first, count), numbers.begin() + std::ptrdiff_t(first),
                           [](double value) { return static_cast<Number>(value); });
  });
  return numbers;
}

std::span<const double> coordinatesOf(const std::vector<Vector3>& vectors) {
  static_assert(sizeof(Vector3) == 3 * sizeof(double));
  return {vectors.empty() ? nullptr : vectors.front().data(), 3 * vectors.size()};
}

/// The arrays of a .npz file, and the numbers to which their views refer.
template <typename Number>
class ArraysOfFile {
 public:
  void addVectors(const char* name, const std::vector<Vector3>& vectors) {
    add(name, numbersOf<Number>(coordinatesOf(vectors)), {vectors.size(), 3});
  }
  void addNumbers(const char* name, const std::vector<double>& values) {
    add(name, numbersOf<Number>(values), {values.size()});
  }
  void add(const char* name, std::vector<Number> numbers, std::vector<std::size_t> shape) {
    numbers_.push_back(std::move(numbers));  // moving a vector leaves its elements where they are
    arrays_.push_back({name, arrays::viewOf(std::span<const Number>(numbers_.back()), std::move(shape))});
  }
  template <typename T>
  void addView(const char* name, std::span<const T> values) {
    arrays_.push_back({name, arrays::viewOf(values, {values.size()})});
  }

  void write(OutputFile& out) const {
    arrays::writeNpz(arrays_, [&](std::span<const std::byte> bytes) { out.write(bytes); });
  }

 private:
  std::vector<std::vector<Number>> numbers_;
  std::vector<arrays::NamedArray> arrays_;
};

template <typename Number>
void writeArrays(const SamplePoints& samples, OutputFile& out) {
  static_assert(sizeof(PointKind) == 1);
  ArraysOfFile<Number> file;
  file.addVectors("points", samples.points);
  file.addNumbers("distances", samples.distances);
  file.addVectors("gradients", samples.gradients);
  const std::span kinds(reinterpret_cast<const std::uint8_t*>(samples.kinds.data()), samples.size());
  file.addView("kinds", kinds);
  // Triangles are fewer than 2^31, and PyTorch has no unsigned integers of 32 bits.
  const std::vector<std::int32_t> faces(samples.faces.begin(), samples.faces.end());
  if (!samples.faces.empty()) {
    file.addVectors("closest", samples.closest);
    file.addView("faces", std::span(faces));
    file.addVectors("normals", samples.normals);
  }
  file.write(out);
}

template <typename Number>
void writeDeepSdf(const SamplePoints& samples, OutputFile& out) {
  ArraysOfFile<Number> file;
  for (const bool positive : {true, false}) {
    std::vector<Number> rows;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if ((samples.distances[i] > 0) != positive) continue;
      for (const double coordinate : samples.points[i]) rows.push_back(static_cast<Number>(coordinate));
      rows.push_back(static_cast<Number>(samples.distances[i]));
    }
    const std::size_t count = rows.size() / 4;
    file.add(positive ? "pos" : "neg", std::move(rows), {count, 4});
  }
  file.write(out);
}

/// A column of a table: numbers, kinds or faces.
struct SampleColumn {
  std::string_view name;
  enum class Type : std::uint8_t { number, kind, face } type;
  const double* first = nullptr;  ///< for numbers: the first one
  std::size_t stride = 1;         ///< for numbers: the distance from one to the next
};

std::vector<SampleColumn> columnsOf(const SamplePoints& samples) {
  using Type = SampleColumn::Type;
  std::vector<SampleColumn> columns;
  const auto addVectors = [&](const std::vector<Vector3>& vectors, std::array<std::string_view, 3> names) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      columns.push_back({names[axis], Type::number, coordinatesOf(vectors).data() + axis, 3});
  };
  addVectors(samples.points, {"x", "y", "z"});
  columns.push_back({"distance", Type::number, samples.distances.data()});
  addVectors(samples.gradients, {"gx", "gy", "gz"});
  columns.push_back({"kind", Type::kind});
  if (samples.faces.empty()) return columns;
  addVectors(samples.closest, {"px", "py", "pz"});
  columns.push_back({"face", Type::face});
  addVectors(samples.normals, {"nx", "ny", "nz"});
  return columns;
}

/// Calls number(n), kind(n) or face(n) with the value of a column in a row.
template <typename Number, typename Visit>
void visitValue(const SamplePoints& samples, const SampleColumn& column, std::size_t row, const Visit& visit) {
  switch (column.type) {
    case SampleColumn::Type::number:
      return visit(static_cast<Number>(column.first[row * column.stride]));
    case SampleColumn::Type::kind:
      return visit(static_cast<std::uint8_t>(samples.kinds[row]));
    case SampleColumn::Type::face:
      return visit(static_cast<std::int32_t>(samples.faces[row]));
  }
}

/// Writes the rows of a table, which append(text, row) formats. Threads format pieces of it.
template <typename Append>
void writeRows(std::size_t rows, OutputFile& out, const Append& append) {
  std::vector<std::string> pieces(kPiecesAtOnce);
  for (std::size_t begin = 0; begin < rows; begin += kPiecesAtOnce * kRowsOfPiece) {
    detail::forEachChunk(std::min(kPiecesAtOnce * kRowsOfPiece, rows - begin), kRowsOfPiece,
                         [&](std::size_t piece, std::size_t first, std::size_t count) {
                           pieces[piece].clear();
                           for (std::size_t i = 0; i < count; ++i) append(pieces[piece], begin + first + i);
                         });
    for (std::string& piece : pieces) {
      out.write(piece);
      piece.clear();
    }
  }
}

template <typename Number>
void writeSamplePly(const SamplePoints& samples, OutputFile& out) {
  static_assert(std::endian::native == std::endian::little, "a PLY file is written as its numbers are in memory");
  const std::vector<SampleColumn> columns = columnsOf(samples);
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(samples.size()) + "\n";
  for (const SampleColumn& column : columns) {
    header += column.type == SampleColumn::Type::kind   ? "property uchar "
              : column.type == SampleColumn::Type::face ? "property int "
              : std::is_same_v<Number, float>           ? "property float "
                                                        : "property double ";
    header.append(column.name) += '\n';
  }
  out.write(header + "end_header\n");
  writeRows(samples.size(), out, [&](std::string& bytes, std::size_t row) {
    for (const SampleColumn& column : columns)
      visitValue<Number>(samples, column, row,
                         [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); });
  });
}

template <typename Number>
void writeCsv(const SamplePoints& samples, OutputFile& out) {
  const std::vector<SampleColumn> columns = columnsOf(samples);
  std::string header;
  for (const SampleColumn& column : columns) (header += header.empty() ? "" : ",") += column.name;
  out.write(header + "\n");
  writeRows(samples.size(), out, [&](std::string& text, std::size_t row) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (c > 0) text += ',';
      visitValue<Number>(samples, columns[c], row, [&](auto value) { detail::appendNumber(text, value); });
    }
    text += '\n';
  });
}

template <typename Number>
void writeSamples(const SamplePoints& samples, SampleFormat format, SampleLayout layout, OutputFile& out) {
  if (format == SampleFormat::ply) return writeSamplePly<Number>(samples, out);
  if (format == SampleFormat::csv) return writeCsv<Number>(samples, out);
  layout == SampleLayout::deepSdf ? writeDeepSdf<Number>(samples, out) : writeArrays<Number>(samples, out);
}

}  // namespace

void saveSamples(const SamplePoints& samples, const std::filesystem::path& file, const SampleFileOptions& options) {
  const SampleFormat format = sampleFormat(file, options);
  OutputFile out(file);
  options.doubles ? writeSamples<double>(samples, format, options.layout, out)
                  : writeSamples<float>(samples, format, options.layout, out);
  out.commit();
}

void checkSamplesWritable(const std::filesystem::path& file, const SampleFileOptions& options) {
  sampleFormat(file, options);
  checkWritable(file);
}

}  // namespace hpsdf
