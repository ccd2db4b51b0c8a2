#include "field/io/triangle_streams.h"

#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <variant>

#include "hpsdf/detail/triangle_list.h"

namespace hpsdf::io {
namespace {

/// The forms of an array that has two. The smaller one is stored.
enum class Form : std::uint8_t { bytes, split };

Form readForm(StreamsReader& reader) {
  std::uint8_t form = 0;
  reader.readNumber(form);
  reader.require(form <= std::uint8_t(Form::split), "an array has an unknown form");
  return Form(form);
}

/// Adds the smaller one of the two forms of an array.
void addSmaller(StreamsWriter& writer, const Bytes& bytes, const StreamsWriter& split) {
  StreamsWriter whole;
  whole.add(bytes);
  const bool isSplit = split.size() < whole.size();
  writer.addNumber(std::uint8_t(isSplit ? Form::split : Form::bytes));
  writer.append(isSplit ? split : whole);
}

/// The bits of the coordinates of vertices, as unsigned integers.
template <typename Vertex>
using CoordinateBits =
    std::conditional_t<sizeof(typename Vertex::Scalar) == sizeof(std::uint32_t), std::uint32_t, std::uint64_t>;
template <typename Vertex>
using VertexBits = std::array<CoordinateBits<Vertex>, 3>;

template <typename Vertex>
void addVerticesOf(StreamsWriter& writer, const std::vector<Vertex>& vertices) {
  std::vector<VertexBits<Vertex>> bits(vertices.size());
  const Bytes bytes = bytesOf(vertices);
  std::memcpy(bits.data(), bytes.data(), bytes.size());
  for (std::size_t i = bits.size(); i-- > 1;)
    for (int axis = 0; axis < 3; ++axis)
      bits[i][axis] = zigzag<CoordinateBits<Vertex>>(bits[i][axis] - bits[i - 1][axis]);
  StreamsWriter differences;
  differences.addPlanes(bits);
  addSmaller(writer, bytes, differences);
}

template <typename Vertex>
void readVerticesOf(StreamsReader& reader, std::uint64_t count, std::vector<Vertex>& vertices) {
  if (readForm(reader) == Form::bytes) {
    reader.require(count <= ~std::uint64_t{0} / sizeof(Vertex), "it has too many vertices");
    const Bytes bytes = reader.read(count * sizeof(Vertex));
    vertices.resize(count);
    std::memcpy(reinterpret_cast<std::uint8_t*>(vertices.data()), bytes.data(), bytes.size());
    return;
  }
  std::vector<VertexBits<Vertex>> bits;
  reader.readPlanes(bits, count);
  for (std::size_t i = 1; i < bits.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) bits[i][axis] = bits[i - 1][axis] + unzigzag(bits[i][axis]);
  vertices.resize(bits.size());
  std::memcpy(reinterpret_cast<std::uint8_t*>(vertices.data()), bits.data(), bits.size() * sizeof(Vertex));
}

/// The words of lists, sorted by what they mean.
struct ListParts {
  using Reference = std::array<std::uint32_t, TriangleListView::kReferenceWords>;
  std::vector<std::uint32_t> counts;  ///< first word of each list
  Bytes octants;
  Bytes lengths;  ///< of each run, the five bits above the first triangle
  std::vector<std::uint32_t>
      firsts;  ///< of each run, the first triangle as the difference from the end of the run before
  std::vector<Reference> references;
};

std::uint32_t endOf(std::uint32_t run) { return triangle_run::first(run) + triangle_run::length(run); }

/// Sorts the words of a list into the parts. `end` is the end of the last run, before and after the call.
void splitList(std::span<const std::uint32_t> words, std::uint32_t& end, ListParts& parts) {
  const TriangleListView list(words.data());
  parts.counts.push_back(words[0]);
  parts.octants.insert(parts.octants.end(), list.octants(),
                       list.octants() + 4 * (TriangleListView::runsAt(list.count()) - 1));
  list.forEachRun([&](std::uint32_t run) {
    parts.lengths.push_back(std::uint8_t(run >> 27));
    parts.firsts.push_back(zigzag(triangle_run::first(run) - end));
    end = endOf(run);
  });
  if (!list.hasReference()) return;
  ListParts::Reference& reference = parts.references.emplace_back();
  std::copy_n(list.referenceWords(), reference.size(), reference.begin());
}

/// Sorts the words of lists that stand one after the other. Returns std::nullopt if a list is not whole.
std::optional<ListParts> sortedLists(const std::vector<std::uint32_t>& lists) {
  ListParts parts;
  std::uint32_t end = 0;
  for (std::size_t at = 0; at < lists.size();) {
    const std::size_t words = listWords(lists, at);
    if (words == 0) return std::nullopt;
    splitList(std::span(lists).subspan(at, words), end, parts);
    at += words;
  }
  return parts;
}

/// Puts lists together from their parts.
class ListJoiner {
 public:
  explicit ListJoiner(const ListParts& parts) : parts_(parts) {}

  /// Returns the lists, which have so many words; fewer if some runs are missing.
  std::vector<std::uint32_t> joined(std::size_t size) {
    words_.reserve(size);
    for (const std::uint32_t count : parts_.counts) {
      words_.push_back(count);
      addOctants(TriangleListView::runsAt(TriangleListView(&count).count()) - 1);
      addRuns();
      if (TriangleListView(&count).hasReference())
        for (const std::uint32_t word : parts_.references[reference_++]) words_.push_back(word);
    }
    return std::move(words_);
  }

 private:
  void addOctants(std::size_t words) {
    const std::size_t start = words_.size();
    words_.resize(start + words);
    if (words > 0) std::memcpy(&words_[start], parts_.octants.data() + octants_, 4 * words);
    octants_ += 4 * words;
  }

  void addRuns() {
    for (bool isLast = false; !isLast && run_ < parts_.lengths.size(); ++run_) {
      const std::uint32_t first = (end_ + unzigzag(parts_.firsts[run_])) & (triangle_run::kMostTriangles - 1);
      const std::uint32_t run = std::uint32_t{parts_.lengths[run_]} << 27 | first;
      words_.push_back(run);
      end_ = endOf(run);
      isLast = triangle_run::isLast(run);
    }
  }

  const ListParts& parts_;
  std::vector<std::uint32_t> words_;
  std::size_t octants_ = 0, run_ = 0, reference_ = 0;
  std::uint32_t end_ = 0;
};

void addParts(StreamsWriter& writer, const ListParts& parts) {
  writer.addNumber(std::uint64_t{parts.counts.size()});
  writer.addNumber(std::uint64_t{parts.lengths.size()});
  writer.addPlanes(parts.counts);
  writer.add(parts.octants);
  writer.add(parts.lengths);
  writer.addPlanes(parts.firsts);
  writer.addPlanes(parts.references);
}

/// Reads the parts of lists that have so many words.
ListParts readParts(StreamsReader& reader, std::uint64_t words) {
  ListParts parts;
  std::uint64_t lists = 0, runs = 0;
  reader.readNumber(lists);
  reader.readNumber(runs);
  reader.require(lists <= words && runs <= words, "its lists of triangles have another size");
  reader.readPlanes(parts.counts, lists);
  std::uint64_t octantWords = 0, references = 0;
  for (const std::uint32_t count : parts.counts) {
    octantWords += TriangleListView::runsAt(TriangleListView(&count).count()) - 1;
    references += TriangleListView(&count).hasReference() ? 1 : 0;
  }
  reader.require(lists + octantWords + runs + references * TriangleListView::kReferenceWords == words,
                 "its lists of triangles have another size");
  parts.octants = reader.read(4 * octantWords);
  parts.lengths = reader.read(runs);
  reader.readPlanes(parts.firsts, runs);
  reader.readPlanes(parts.references, references);
  return parts;
}

}  // namespace

std::size_t listWords(const std::vector<std::uint32_t>& lists, std::size_t offset) {
  if (offset >= lists.size()) return 0;
  const TriangleListView list(&lists[offset]);
  std::size_t end = offset + TriangleListView::runsAt(list.count());
  while (end < lists.size() && !triangle_run::isLast(lists[end])) ++end;
  end += 1 + (list.hasReference() ? TriangleListView::kReferenceWords : 0);
  return end <= lists.size() ? end - offset : 0;
}

void addVertices(StreamsWriter& writer, const ExactTriangles& exact) {
  std::visit(
      [&](const auto& vertices) {
        if (!vertices.empty()) addVerticesOf(writer, vertices);
      },
      exact.vertices);
}

void readVertices(StreamsReader& reader, const FieldSizes& sizes, ExactTriangles& exact) {
  const auto read = [&](auto& vertices) {
    if (sizes.vertices > 0) readVerticesOf(reader, sizes.vertices, vertices);
  };
  if (sizes.vertexBytes == sizeof(float))
    read(exact.vertices.emplace<std::vector<Eigen::Vector3f>>());
  else
    read(exact.vertices.emplace<std::vector<Eigen::Vector3d>>());
}

// Vertices are numbered in the order in which triangles use them, so that many a corner is the next new vertex.

void addTriangles(StreamsWriter& writer, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<std::uint32_t> differences;
  std::uint32_t newest = 0;
  for (const auto& triangle : triangles)
    for (const std::uint32_t vertex : triangle) {
      differences.push_back(newest - vertex);
      newest += vertex == newest ? 1 : 0;
    }
  writer.addPlanes(differences);
}

std::vector<std::array<std::uint32_t, 3>> readTriangles(StreamsReader& reader, std::uint64_t count) {
  reader.require(count <= ~std::uint64_t{0} / 3, "it has too many triangles");
  std::vector<std::uint32_t> differences;
  reader.readPlanes(differences, 3 * count);
  std::vector<std::array<std::uint32_t, 3>> triangles(count);
  std::uint32_t newest = 0;
  auto next = differences.begin();
  for (auto& triangle : triangles)
    for (std::uint32_t& vertex : triangle) {
      vertex = newest - *next++;
      newest += vertex == newest ? 1 : 0;
    }
  return triangles;
}

void addLists(StreamsWriter& writer, const std::vector<std::uint32_t>& lists) {
  if (lists.empty()) return;
  const Bytes bytes = bytesOf(lists);
  const std::optional<ListParts> parts = sortedLists(lists);
  if (!parts) {
    writer.addNumber(std::uint8_t(Form::bytes));
    return writer.add(bytes);
  }
  StreamsWriter split;
  addParts(split, *parts);
  addSmaller(writer, bytes, split);
}

std::vector<std::uint32_t> readLists(StreamsReader& reader, std::uint64_t words) {
  if (words == 0) return {};
  std::vector<std::uint32_t> lists;
  if (readForm(reader) == Form::bytes) {
    reader.require(words <= ~std::uint64_t{0} / sizeof(std::uint32_t), "its lists of triangles are too long");
    const Bytes bytes = reader.read(words * sizeof(std::uint32_t));
    lists.resize(words);
    std::memcpy(lists.data(), bytes.data(), bytes.size());
    return lists;
  }
  const ListParts parts = readParts(reader, words);
  lists = ListJoiner(parts).joined(words);
  reader.require(lists.size() == words, "a list of triangles has a wrong length");
  return lists;
}

}  // namespace hpsdf::io
