// Tests the input that readers of mesh formats take and refuse: one test for each trait of files that readers are known
// to get wrong.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace mesh_formats_test {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::array<std::array<int, 3>, 4> kCorners = {{{5, 6, 7}, {6, 6, 7}, {5, 8, 7}, {5, 6, 10}}};
constexpr std::array<std::array<int, 3>, 4> kFaces = {{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};

/// Appends a number to the bytes of a file, in either byte order.
template <typename T>
void append(std::string& bytes, T value, std::endian order = std::endian::little) {
  std::array<char, sizeof value> raw;
  std::memcpy(raw.data(), &value, sizeof value);
  if (order != std::endian::native) std::ranges::reverse(raw);
  bytes.append(raw.data(), raw.size());
}

class MeshFormats : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, std::string_view content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }

  TriangleMesh read(const std::string& name, std::string_view content) const { return readMesh(write(name, content)); }

  void expectTetrahedron(const std::string& name, std::string_view content) const {
    SCOPED_TRACE(name + ":\n" + std::string(content.substr(0, 300)));
    const MeshReport report = importMesh(write(name, content)).report;
    EXPECT_EQ(report.vertices, 4u);
    EXPECT_EQ(report.faces, 4u);
    EXPECT_TRUE(report.closed());
    EXPECT_EQ(report.volume, 1);
    EXPECT_EQ(report.box.min(), Vector3(5, 6, 7));
    EXPECT_EQ(report.box.max(), Vector3(6, 8, 10));
  }

  /// Returns the message of the error with which a file is refused, without its name, or "no error".
  std::string errorOf(const std::string& name, std::string_view content) const {
    try {
      importMesh(write(name, content));
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), Not(HasSubstr("\n")));
      EXPECT_EQ(error.subject(), (folder_ / name).string());
      return error.problem();
    }
    return "no error";
  }

  support::TemporaryDirectory folder_;
};

// ---------------------------------------------------------------------------------------------------------------------
// PLY

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kList = "property list uchar int vertex_indices\n";
const std::string kPlyText = "5 6 7\n6 6 7\n5 8 7\n5 6 10\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string ply(const std::string& elements, const std::string& data, const std::string& format = "ascii") {
  return "ply\nformat " + format + " 1.0\n" + elements + "end_header\n" + data;
}

std::string lineEnds(std::string text, const std::string& end) {
  for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += end.size()) text.replace(at, 1, end);
  return text;
}

TEST_F(MeshFormats, plyElementsBeforeVerticesAreSkipped) {
  const std::string camera = "element camera 2\nproperty float focus\nproperty list uchar short tags\n";
  const std::string header = camera + "element vertex 4\n" + kXyz + "element face 4\n" + kList;
  expectTetrahedron("t.ply", ply(header, "1.5 3 7 8 9\n2.5 0\n" + kPlyText));
  std::string data;
  for (const int tags : {3, 0}) {
    append(data, 1.5f);
    append(data, std::uint8_t(tags));
    for (int t = 0; t < tags; ++t) append(data, std::int16_t(t));
  }
  for (const auto& corner : kCorners)
    for (const int x : corner) append(data, float(x));
  for (const auto& face : kFaces) {
    append(data, std::uint8_t{3});
    for (const int v : face) append(data, std::int32_t{v});
  }
  expectTetrahedron("t.ply", ply(header, data, "binary_little_endian"));
}

/// All types of PLY, other properties among x, y and z, and the faces before the vertices.
template <typename Count, typename Index, typename Coordinate>
std::string mixedPly(const std::string& count, const std::string& index, const std::string& coordinate,
                     std::endian order) {
  std::string data;
  for (const auto& face : kFaces) {
    append(data, 2.5, order);
    append(data, Count{3}, order);
    for (const int v : face) append(data, Index(v), order);
    append(data, std::uint8_t{9}, order);
  }
  for (const auto& corner : kCorners) {
    append(data, Coordinate(corner[2]), order);
    append(data, std::int16_t{-1}, order);
    append(data, Coordinate(corner[0]), order);
    append(data, Count{1}, order);
    append(data, 1e30, order);
    append(data, Coordinate(corner[1]), order);
  }
  return ply("element face 4\nproperty double weight\nproperty list " + count + " " + index +
                 " vertex_index\nproperty uint8 flag\nelement vertex 4\nproperty " + coordinate +
                 " z\nproperty short quality\nproperty " + coordinate + " x\nproperty list " + count +
                 " float64 more\nproperty " + coordinate + " y\n",
             data, order == std::endian::big ? "binary_big_endian" : "binary_little_endian");
}

TEST_F(MeshFormats, plyTakesAllTypesInBothByteOrders) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    expectTetrahedron("t.ply", mixedPly<std::uint8_t, std::int32_t, float>("uchar", "int", "float", order));
    expectTetrahedron("t.ply", mixedPly<std::int8_t, std::uint32_t, double>("int8", "uint32", "float64", order));
    expectTetrahedron("t.ply", mixedPly<std::int32_t, std::uint8_t, std::int16_t>("int", "uchar", "short", order));
    expectTetrahedron("t.ply", mixedPly<std::uint16_t, std::int16_t, std::uint8_t>("ushort", "int16", "uint8", order));
    expectTetrahedron("t.ply", mixedPly<std::uint32_t, float, std::int32_t>("uint", "float32", "int32", order));
  }
}

TEST_F(MeshFormats, plyTristrips) {
  // The strips 0 2 1 3 and 3 2 0 1 make the faces 021, 123 and 320, 012 turned.
  const std::string header =
      "element vertex 4\n" + kXyz + "element tristrips 1\nproperty list int int vertex_indices\n";
  const std::string vertices = "5 6 7\n6 6 7\n5 8 7\n5 6 10\n";
  const TriangleMesh mesh = read("t.ply", ply(header, vertices + "13 0 2 1 3 -1 0 1 3 -1 0 3 3 3 2\n"));
  EXPECT_THAT(mesh.triangles, ElementsAre(Triangle{0, 2, 1}, Triangle{1, 2, 3}, Triangle{0, 1, 3}));
  expectTetrahedron("t.ply", ply(header, vertices + "13 0 2 1 3 -1 0 1 3 -1 0 3 2 -1\n"));
  EXPECT_THAT(errorOf("t.ply", ply(header, vertices + "4 0 2 1 7\n")),
              HasSubstr("refers to vertex 8, but there are only 4"));
}

TEST_F(MeshFormats, plyLineEndsAndFirstBytes) {
  const std::string header = "element vertex 4\n" + kXyz + "element face 4\n" + kList;
  for (const char* end : {"\n", "\r\n", "\r"}) {
    expectTetrahedron("t.ply", lineEnds(ply(header, kPlyText), end));
    for (int byte = 0; byte < 256; ++byte) {
      // The first coordinate is a float whose lowest byte is `byte`.
      const float first = std::bit_cast<float>((std::bit_cast<std::uint32_t>(5.0f) & ~255u) | std::uint32_t(byte));
      std::string data;
      for (const auto& corner : kCorners)
        for (std::size_t c = 0; c < 3; ++c) append(data, c == 0 && &corner == &kCorners[0] ? first : float(corner[c]));
      for (const auto& face : kFaces) {
        append(data, std::uint8_t{3});
        for (const int v : face) append(data, std::int32_t{v});
      }
      const TriangleMesh mesh = read("t.ply", lineEnds(ply(header, "", "binary_little_endian"), end) + data);
      EXPECT_EQ(mesh.vertices[0].x(), double{first}) << byte;
      EXPECT_EQ(mesh.triangles.size(), 4u);
    }
  }
}

TEST_F(MeshFormats, plyHoldsWhatItPromises) {
  const std::string header = "element vertex 4\n" + kXyz + "element face 4\n" + kList;
  const std::string whole = ply(header, kPlyText);
  EXPECT_THAT(errorOf("t.ply", whole.substr(0, whole.size() - 8)),
              AllOf(HasSubstr("line 17: "), HasSubstr("the file ends")));
  EXPECT_THAT(errorOf("t.ply", whole.substr(0, whole.find("6 6 7")) + std::string(100, ' ')),
              HasSubstr("line 11: the file ends at number 2 of 4 of the element 'vertex'"));
  EXPECT_THAT(errorOf("t.ply", whole + "3 1 2 3\n"), HasSubstr("line 18: the file goes on behind the elements"));
  expectTetrahedron("t.ply", whole + "\n \n");
  EXPECT_THAT(errorOf("t.ply", ply("element vertex 4\n" + kXyz + "element face 40\n" + kList, kPlyText)),
              HasSubstr("its header promises 40 faces"));
  std::string binary = mixedPly<std::uint8_t, std::int32_t, float>("uchar", "int", "float", std::endian::little);
  EXPECT_THAT(errorOf("t.ply", binary + "x"),
              HasSubstr("the file goes on behind the elements that its header promises"));
  for (const std::size_t cut : {1, 30, 100})
    EXPECT_THAT(errorOf("t.ply", binary.substr(0, binary.size() - cut)),
                ::testing::AnyOf(HasSubstr("the file ends at number"), HasSubstr("its header promises 4 vertices")));
}

TEST_F(MeshFormats, plyLinesMayHoldMoreThanTheirElement) {
  const std::string header = "element vertex 4\n" + kXyz + "element face 4\n" + kList;
  expectTetrahedron("t.ply",
                    ply(header, "5 6 7 0 0 1\n6 6 7\n5 8 7\n5 6 10\n3 0 2 1 255 0 0\n3 0\n1 3\n3 0 3 2\n3 1 2 3\n"));
}

TEST_F(MeshFormats, plyIndicesMayBeFloats) {
  const std::string header = "element vertex 4\n" + kXyz + "element face 4\nproperty list uchar float vertex_indices\n";
  expectTetrahedron("t.ply", ply(header, "5 6 7\n6 6 7\n5 8 7\n5 6 10\n3 0.0 2 1\n3 0 1 3.0\n3 0 3 2\n3 1e0 2 3\n"));
  EXPECT_THAT(errorOf("t.ply", ply(header, "5 6 7\n6 6 7\n5 8 7\n5 6 10\n3 0.5 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")),
              HasSubstr("an index is no whole number"));
}

TEST_F(MeshFormats, plyHeadersAreChecked) {
  const auto error = [&](const std::string& header) { return errorOf("t.ply", header); };
  EXPECT_THAT(error("plyx\n"), HasSubstr("line 1: a PLY file begins with the line 'ply'"));
  EXPECT_THAT(error("ply\nformat ascii 2.0\nend_header\n"), HasSubstr("line 2: expected 'format'"));
  EXPECT_THAT(error("ply\nelement vertex 4\nend_header\n"), HasSubstr("has no line 'format'"));
  EXPECT_THAT(error("ply\nformat ascii 1.0\nelement vertex -4\n"), HasSubstr("line 3: '-4' is no number of elements"));
  EXPECT_THAT(error("ply\nformat ascii 1.0\nelement vertex 4\nproperty real x\n"),
              HasSubstr("line 4: unknown type 'real'"));
  EXPECT_THAT(error("ply\nformat ascii 1.0\nproperty float x\n"), HasSubstr("a property before the first element"));
  EXPECT_THAT(error("ply\nformat ascii 1.0\nelement vertex 4\nelement vertex 4\n"),
              HasSubstr("a second element 'vertex'"));
  EXPECT_THAT(error(ply("element vertex 1\nproperty float x\nproperty float y\n", "1 2\n")),
              HasSubstr("the element 'vertex' has no number 'z'"));
  EXPECT_THAT(error(ply("element vertex 4\n" + kXyz + "element face 4\nproperty uchar red\n", kPlyText)),
              HasSubstr("the element 'face' has no list 'vertex_indices'"));
  EXPECT_THAT(error(ply("element vertex 4\n" + kXyz + "element face 4\nproperty list char int vertex_indices\n",
                        "5 6 7\n6 6 7\n5 8 7\n5 6 10\n-3 0 2 1\n")),
              HasSubstr("line 14: a list of -3 items"));
  EXPECT_THAT(
      error(ply("element vertex 4\n" + kXyz + "element face 4\n" + kList, "5 6 7\n6 6 x7\n" + std::string(100, ' '))),
      HasSubstr("line 11: expected a number, found 'x7'"));
}

// ---------------------------------------------------------------------------------------------------------------------
// OFF

const std::string kOffVertices = "5 6 7\n6 6 7\n5 8 7\n5 6 10\n";
const std::string kOffFaces = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

TEST_F(MeshFormats, offCommentsAndWhiteSpaceMayStandAnywhere) {
  expectTetrahedron("t.off", "OFF\n4 4 6\n" + kOffVertices + kOffFaces);
  expectTetrahedron("t.off", "OFF 4 4 6\n" + kOffVertices + kOffFaces);
  expectTetrahedron("t.off", "4 4 6\n" + kOffVertices + kOffFaces);
  expectTetrahedron("t.off", lineEnds("OFF\n4 4 6\n" + kOffVertices + kOffFaces, "\r\n"));
  expectTetrahedron(
      "t.off",
      "# a tetrahedron\nOFF # the keyword\n\n4 4 # counts\n 6\n5 6 7 6 6\n\t7\n# four vertices\n5 8 7\n5 6 10\n"
      "# faces\n3 0 2 1 # red\n# one more\n3\n0 1\n3\n3 0 3 2\n\n3 1 2 3\n# the end");
}

TEST_F(MeshFormats, offKeywordsWithMoreThanCoordinates) {
  expectTetrahedron("t.off",
                    "COFF\n4 4 6\n5 6 7 255 0 0 255\n6 6 7 0 0 0 0\n5 8 7 1 1 1 1\n5 6 10 1 1 1 1\n" + kOffFaces);
  expectTetrahedron("t.off", "NOFF 4 4 6\n5 6 7 0 0 1\n6 6 7 0 0 1\n5 8 7 0 0 1\n5 6 10 0 0 1\n" + kOffFaces);
  expectTetrahedron("t.off", "STOFF 4 4 6\n5 6 7 0 1\n6 6 7 0 1\n5 8 7 0 1\n5 6 10 0 1\n" + kOffFaces);
  expectTetrahedron("t.off", "NCOFF 4 4 6\n5 6 7 0 1\n6 6 7 0 1\n5 8 7 0 1\n5 6 10 0 1\n" + kOffFaces);
  expectTetrahedron("t.off", "OFF\n4 4 6\n" + kOffVertices +
                                 "3 0 2 1 255 0 0\n3 0 1 3 0.5 0.5 0.5 1\n3 0 3 2 7\n3 1 2 3 # no colour\n");
  const std::string colours = "5 6 7 255 0 0 255\n6 6 7 0 0 0 0\n5 8 7 1 1 1 1\n5 6 10 1 1 1 1\n";
  EXPECT_THAT(errorOf("t.off", "OFF 4 4 6\n" + colours + kOffFaces), HasSubstr("line 4: face 2 refers to vertex 9"));
  EXPECT_THAT(errorOf("t.off", "4OFF 1 0 0\n5 6 7 1\n"), HasSubstr("'4OFF' has vertices of another dimension than 3"));
  EXPECT_THAT(errorOf("t.off", "OFF BINARY\n"), HasSubstr("binary OFF files are not read"));
  EXPECT_THAT(errorOf("t.off", "CUBE\n8 6 12\n"), HasSubstr("line 1: expected 'OFF'"));
}

TEST_F(MeshFormats, offHoldsWhatItPromises) {
  const std::string whole = "OFF\n4 4 6\n" + kOffVertices + kOffFaces;
  EXPECT_THAT(errorOf("t.off", whole.substr(0, whole.find("3 0 3 2"))),
              HasSubstr("line 9: the file ends at face 3 of 4"));
  EXPECT_THAT(errorOf("t.off", "OFF\n4 4 6\n5 6 7\n6 6 7\n# no more vertices here, alas\n"),
              HasSubstr("the file ends at vertex 3 of 4"));
  EXPECT_THAT(errorOf("t.off", whole + "3 1 2 3\n"), HasSubstr("line 11: the file goes on behind the 4 faces"));
  // The second face on a line reads like the colour of the first one, so that faces are missing at the end.
  EXPECT_THAT(errorOf("t.off", "OFF\n4 4 6\n" + kOffVertices + "3 0 2 1 3 0 1 3\n3 0 3 2 3 1 2 3\n"),
              HasSubstr("line 9: the file ends at face 3 of 4"));
  EXPECT_THAT(errorOf("t.off", "OFF\n4 4 6\n" + kOffVertices + "3 0 2 1.5\n"),
              HasSubstr("line 7: '.5' follows the number 1 (a corner of a face)"));
  EXPECT_THAT(errorOf("t.off", "OFF\n-4 4 6\n"), HasSubstr("line 2: -4 is no number of vertices"));
}

// ---------------------------------------------------------------------------------------------------------------------
// OBJ

const std::string kObjVertices = "v 5 6 7\nv 6 6 7\nv 5 8 7\nv 5 6 10\n";
const std::string kObjFaces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST_F(MeshFormats, objIsReadHoweverItIsWritten) {
  expectTetrahedron("t.obj", "\xef\xbb\xbf" + kObjVertices + kObjFaces);
  expectTetrahedron("t.obj", lineEnds(kObjVertices + kObjFaces, "\r\n"));
  expectTetrahedron("t.obj", lineEnds(kObjVertices + kObjFaces, "\r"));
  expectTetrahedron(
      "t.obj", "v 5 6 7#first\nv 6 6 7 # second\nv 5 8 7\nv 5 6 10\nf 1 3 2#\nf 1 2 4 # x\n f 1 4 3\n\tf\t2 3\t4  \n");
  expectTetrahedron("t.obj",
                    "v 5 6\\\n 7\nv 6 \\\r\n6 7\nv 5 8 7\nv 5 6 10\nf 1 \\\n3 \\  \n2\nf 1 2 4\nf 1 4 3\nf 2 3 4");
  expectTetrahedron("t.obj", kObjVertices + "f -4 -2 -3\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1\n");
  expectTetrahedron("t.obj",
                    kObjVertices + "vt 0 0\nvn 0 0 1\nf 1/1 3/1 2/1\nf 1//1 2//1 4//1\nf 1/1/1 4/ 3/1/\nf 2// 3 4\n");
  expectTetrahedron("t.obj",
                    "o a\ng b c\nmtllib x.mtl\nusemtl y\ns off\nv 5 6 7 1.0\nv 6 6 7 0.5 0.5 0.5\nv 5 8 7\nv 5 6 10\n" +
                        kObjFaces + "l 1 2\np 1\ncurv 0 1 1 2\nvp 1 2\ncstype rat bspline\n");
  expectTetrahedron("t.obj", kObjFaces + kObjVertices);  // faces may refer to later vertices
  expectTetrahedron("t.obj", kObjVertices + "g a \\\nf 1 2 3\n# a comment ends with its line \\\n" + kObjFaces + "\\");
  expectTetrahedron("t.obj", kObjVertices + "f 0001 03 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  expectTetrahedron("t.obj", "v +5 6.0 7e0\nv 6 .6e1 7.\nv 5 8 7\nv 5 6 10\n" + kObjFaces);
}

TEST_F(MeshFormats, objPolygons) {
  const std::string box = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
  const std::string sides = "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  for (const std::string& text : {box + sides, sides + box}) {
    const MeshReport report = importMesh(write("t.obj", text)).report;
    EXPECT_EQ(report.faces, 12u);
    EXPECT_TRUE(report.closed());
    EXPECT_EQ(report.volume, 1);
  }
}

TEST_F(MeshFormats, objErrorsNameTheLine) {
  EXPECT_THAT(errorOf("t.obj", kObjVertices + "f 1 3 2\nf 1 2 0\n"), HasSubstr("line 6: face 2 refers to vertex 0"));
  EXPECT_THAT(errorOf("t.obj", kObjVertices + "f 1 3 2\nf 1 2 -5\n"), HasSubstr("line 6: face 2 refers to vertex -5"));
  EXPECT_THAT(errorOf("t.obj", "f 1 2 5\n" + kObjVertices),
              HasSubstr("line 1: face 1 refers to vertex 5, but there are only 4"));
  EXPECT_THAT(errorOf("t.obj", kObjVertices + "f 1 2\\\n x\n"),
              HasSubstr("line 6: expected a whole number (the number of a vertex), found 'x'"));
  EXPECT_THAT(errorOf("t.obj", kObjVertices + "f 1 2 3x\n"), HasSubstr("line 5: 'x' follows the numbers of a corner"));
  EXPECT_THAT(errorOf("t.obj", kObjVertices + "f 1 2 99999999999999999999\n"),
              HasSubstr("line 5: expected a whole number"));
  EXPECT_THAT(errorOf("t.obj", "v 1 2\n"), HasSubstr("line 1: a vertex with fewer than three coordinates"));
  EXPECT_THAT(errorOf("t.obj", "v 1 2 3,5\n"), HasSubstr("line 1: expected a number, found '3,5'"));
  EXPECT_THAT(errorOf("t.obj", "\xff\xfev\0 \0"), HasSubstr("the text is UTF-16"));
  EXPECT_THAT(errorOf("t.obj", "v 1 2 " + std::string(5000, '7') + "\n"), HasSubstr("line 1: "));
  EXPECT_THAT(errorOf("t.obj", "v 1. 2 1." + std::string(300'000, '0') + "\n"), HasSubstr("line 1: "));
  EXPECT_THAT(errorOf("t.obj", kObjVertices + "f 1 2 9999999999999999999\n"),
              HasSubstr("line 5: expected a whole number"));
}

// ---------------------------------------------------------------------------------------------------------------------
// STL

std::string stlText(const std::string& name = "t") {
  std::ostringstream text;
  text << "solid " << name << "\n";
  for (const auto& face : kFaces) {
    text << "  facet normal nan 0 1\n    outer loop\n";
    for (const int v : face) {
      const auto& [x, y, z] = kCorners[std::size_t(v)];
      text << "      vertex " << x << " " << y << " " << z << "\n";
    }
    text << "    endloop\n  endfacet\n";
  }
  text << "endsolid " << name << "\n";
  return text.str();
}

std::string stlBinary(const std::string& header, std::uint32_t faces = 4) {
  std::string file = header + std::string(80 - header.size(), ' ');
  append(file, faces);
  for (const auto& face : kFaces) {
    for (int i = 0; i < 3; ++i) append(file, 0.0f);
    for (const int v : face)
      for (const int x : kCorners[std::size_t(v)]) append(file, float(x));
    append(file, std::uint16_t{0xffff});
  }
  return file;
}

TEST_F(MeshFormats, stlTextAndBinary) {
  expectTetrahedron("t.stl", stlText());
  expectTetrahedron("t.stl", lineEnds(stlText("facet vertex endsolid"), "\r\n"));
  expectTetrahedron("t.stl", "  \n" + stlText(""));
  std::string upper = stlText();
  std::ranges::transform(upper, upper.begin(), [](char c) { return char(std::toupper(c)); });
  expectTetrahedron("t.stl", upper);
  expectTetrahedron("t.stl", stlBinary("made by hand"));
  expectTetrahedron("t.stl", stlBinary("solid made by a CAD system"));
  expectTetrahedron("t.stl", stlText(std::string(10'000, 'n')));
  expectTetrahedron("t.stl", stlBinary(std::string("solid facet normal\0", 19)));
  std::string two = stlText();
  two.insert(two.find("  facet", two.size() / 2), "endsolid t\nsolid u\n");
  expectTetrahedron("t.stl", two);
}

TEST_F(MeshFormats, stlHoldsWhatItPromises) {
  const std::string text = stlText(), binary = stlBinary("made by hand");
  EXPECT_THAT(errorOf("t.stl", text.substr(0, text.find("endsolid"))),
              HasSubstr("line 30: expected 'facet', but the file ends"));
  EXPECT_THAT(errorOf("t.stl", text.substr(0, text.size() / 2)), HasSubstr("but the file ends"));
  EXPECT_THAT(errorOf("t.stl", text + "and more\n"), HasSubstr("expected 'solid', found 'and'"));
  EXPECT_THAT(errorOf("t.stl", binary.substr(0, binary.size() - 10)),
              HasSubstr("it promises 4 faces of 50 bytes, but only 190"));
  EXPECT_THAT(errorOf("t.stl", binary + "more"), HasSubstr("the file goes on behind the 4 faces"));
  EXPECT_THAT(errorOf("t.stl", "short"), HasSubstr("neither a binary nor a text STL file"));
  std::string four = text;
  four.insert(four.find("    endloop"), "      vertex 1 2 3\n");
  EXPECT_THAT(errorOf("t.stl", four), HasSubstr("line 7: expected 'endloop', found 'vertex'"));
}

// ---------------------------------------------------------------------------------------------------------------------
// Digits

/// Numbers with 17 digits, some of them with details of 1e-6 at 1e7 from the origin.
std::vector<Vector3> manyDigits() {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vector3> points;
  for (int i = 0; i < 300; ++i) {
    const double scale = std::array<double, 4>{1, 1e-6, 1e7, 1e-300}[std::size_t(i % 4)];
    points.emplace_back(scale * unit(random), 1e7 + 1e-6 * unit(random), unit(random) / 3);
  }
  return points;
}

std::string numbersOf(const Vector3& v) {
  std::ostringstream text;
  text.precision(17);
  text << v.x() << " " << v.y() << " " << v.z();
  return text.str();
}

TEST_F(MeshFormats, textKeepsAllDigitsOfDoubles) {
  const std::vector<Vector3> points = manyDigits();
  std::string obj, lines, stl = "solid\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    obj += "v " + numbersOf(points[i]) + "\n";
    lines += numbersOf(points[i]) + "\n";
    if (i % 3 == 0) stl += "facet normal 0 0 0\nouter loop\n";
    stl += "vertex " + numbersOf(points[i]) + "\n";
    if (i % 3 == 2) stl += "endloop\nendfacet\n";
  }
  const std::string count = std::to_string(points.size());
  const std::string doubles = "property double x\nproperty double y\nproperty double z\n";
  std::string binary;
  for (const Vector3& point : points)
    for (const double x : point) append(binary, x);
  const std::string header = "element vertex " + count + "\n" + doubles;
  EXPECT_EQ(read("t.obj", obj).vertices, points);
  EXPECT_EQ(read("t.off", "OFF " + count + " 0 0\n" + lines).vertices, points);
  EXPECT_EQ(read("t.stl", stl + "endsolid\n").vertices, points);
  EXPECT_EQ(read("t.ply", ply(header, lines)).vertices, points);
  EXPECT_EQ(read("t.ply", ply(header, binary, "binary_little_endian")).vertices, points);
}

TEST_F(MeshFormats, numbersThatDoNotFit) {
  EXPECT_EQ(read("t.obj", "v 1e-400 -1e-400 4.9e-324\n").vertices[0], Vector3(0, 0, 4.9406564584124654e-324));
  EXPECT_EQ(read("t.obj", "v 1.7976931348623157e308 0.1e309 0\n").vertices[0],
            Vector3(1.7976931348623157e308, 1e308, 0));
  for (const std::string bad : {"1e400", "-1e309", "nan", "inf", "0x1p3", "1e", "--1", "+-1", "1_000", "1.2.3"})
    EXPECT_THAT(errorOf("t.obj", "v 1 " + bad + " 2\n"), AllOf(HasSubstr("line 1: "), HasSubstr("'" + bad + "'")))
        << bad;
}

// ---------------------------------------------------------------------------------------------------------------------
// Compression, windows, memory

std::string gzipped(const std::string& text) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY), Z_OK);
  std::string bytes(text.size() + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = unsigned(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = unsigned(bytes.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  bytes.resize(stream.total_out);
  deflateEnd(&stream);
  return bytes;
}

TEST_F(MeshFormats, compressedFiles) {
  const std::string header = "element vertex 4\n" + kXyz + "element face 4\n" + kList;
  expectTetrahedron("t.obj.gz", gzipped(kObjVertices + kObjFaces));
  expectTetrahedron("T.PLY.GZ", gzipped(ply(header, kPlyText)));
  expectTetrahedron("t.stl.gz", gzipped(stlText()));
  expectTetrahedron("t.stl.gz", gzipped(stlBinary("made by hand")));
  expectTetrahedron("t.stl.gz", gzipped(stlBinary("solid facet")));
  expectTetrahedron("t.off.gz", gzipped("OFF 4 4 6\n" + kOffVertices + kOffFaces));
  EXPECT_THAT(errorOf("t.stl.gz", gzipped(stlBinary("made by hand").substr(0, 200))),
              HasSubstr("the file ends at face 3 of 4"));
  const std::string whole = gzipped(stlBinary("made by hand"));
  EXPECT_THAT(errorOf("t.stl.gz", whole.substr(0, whole.size() - 20)),
              HasSubstr("compressed data are damaged or cut off"));
  std::string damaged = whole;
  damaged[damaged.size() / 2] ^= 0x55;
  EXPECT_THAT(errorOf("t.stl.gz", damaged), HasSubstr("compressed data are damaged or cut off"));
}

/// Text of every length before it shifts words over the ends of the window through which the file is read.
TEST_F(MeshFormats, wordsAcrossTheEndsOfTheWindow) {
  std::string vertices, faces;
  for (int i = 0; i < 20000; ++i) {
    vertices += "v " + std::to_string(i) + ".125 " + std::to_string(i % 100) + " 0.5\n";
    if (i >= 2)
      faces += "f " + std::to_string(i - 1) + "/1 " + std::to_string(i) + "/2 " + std::to_string(i + 1) + "/3\n";
  }
  const TriangleMesh expected = read("t.obj", vertices + faces);
  ASSERT_EQ(expected.vertices.size(), 20000u);
  ASSERT_EQ(expected.triangles.size(), 19998u);
  for (const std::size_t shift :
       {1, 2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 4095, 4096, 65535, 262143, 262144, 300000}) {
    const TriangleMesh mesh = read("t.obj", "#" + std::string(shift, ' ') + "\n" + vertices + faces);
    EXPECT_EQ(mesh.vertices, expected.vertices) << shift;
    EXPECT_EQ(mesh.triangles, expected.triangles) << shift;
  }
}

TEST_F(MeshFormats, readingReportsProgressAndIsCancelled) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += "v 1 2 3\n";
  const fs::path file = write("t.obj", text);
  std::vector<double> shares;
  readMesh(file, {.report = [&](std::string_view task, double share) {
             EXPECT_EQ(task, "Reading the mesh");
             shares.push_back(share);
           }});
  EXPECT_GT(shares.size(), 2u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_GT(shares.back(), 0.5);
  int calls = 0;
  EXPECT_THROW(readMesh(file, {.cancelled = [&] { return ++calls > 2; }}), Cancelled);
}

TEST_F(MeshFormats, largePolygonsAreCancelled) {
  std::string text, face = "f";
  for (int i = 0; i < 50'000; ++i) {
    text += "v " + std::to_string(i % 2 == 0 ? 50'000 - i : i) + " 0 0\n";
    face += " " + std::to_string(i + 1);
  }
  bool isTriangulating = false;
  const Progress progress{
      .report = [&](std::string_view task, double) { isTriangulating |= task.starts_with("Triang"); },
      .cancelled = [&] { return isTriangulating; }};
  EXPECT_THROW(readMesh(write("t.obj", text + face + "\n"), progress), Cancelled);
}

// ---------------------------------------------------------------------------------------------------------------------
// glTF

/// A glTF file with the tetrahedron, whose parts tests replace.
struct Gltf {
  std::string attributes = R"("POSITION":0)";
  std::string position = R"("componentType":5126)";
  std::string indices = R"("indices":1,)";
  std::string primitive;  ///< further members of the primitive, each with a comma behind it
  std::string nodes = R"({"mesh":0})";
  std::string scenes = R"("scenes":[{"nodes":[0]}],)";
  std::string more;                      ///< further members of the root, each with a comma behind it
  std::string moreAccessors, moreViews;  ///< further items, each with a comma before it
  std::string data;
  std::size_t positionBytes = 48;

  Gltf() {
    for (const auto& corner : kCorners)
      for (const int x : corner) append(data, float(x));
    for (const auto& face : kFaces)
      for (const int v : face) append(data, std::uint16_t(v));
  }

  std::string text() const {
    std::ostringstream json;
    json << R"({"asset":{"version":"2.0"},)" << more << scenes << R"("nodes":[)" << nodes
         << R"(],"meshes":[{"primitives":[{)" << indices << primitive << R"("attributes":{)" << attributes
         << R"(}}]}],"accessors":[{"bufferView":0,"count":4,"type":"VEC3",)" << position
         << R"(},{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"})" << moreAccessors
         << R"(],"bufferViews":[{"buffer":0,"byteLength":)" << positionBytes << R"(},{"buffer":0,"byteOffset":)"
         << positionBytes << R"(,"byteLength":24})" << moreViews << R"(],"buffers":[{"byteLength":)" << data.size()
         << R"(,"uri":"t%2Ebin"}]})";
    return json.str();
  }
};

class GltfFormat : public MeshFormats {
 protected:
  std::string errorOf(const Gltf& gltf) const {
    write("t.bin", gltf.data);
    return MeshFormats::errorOf("t.gltf", gltf.text());
  }
  ImportedMesh import(const Gltf& gltf) const {
    write("t.bin", gltf.data);
    return importMesh(write("t.gltf", gltf.text()));
  }
  void expectTetrahedron(const Gltf& gltf) const {
    write("t.bin", gltf.data);
    MeshFormats::expectTetrahedron("t.gltf", gltf.text());
  }
};

TEST_F(GltfFormat, requiredExtensions) {
  Gltf gltf;
  expectTetrahedron(gltf);
  for (const char* harmless :
       {"KHR_materials_unlit", "KHR_texture_transform", "EXT_mesh_features", "KHR_mesh_quantization"}) {
    gltf.more = std::string(R"("extensionsRequired":[")") + harmless + R"("],)";
    expectTetrahedron(gltf);
  }
  for (const char* unknown : {"EXT_meshopt_compression", "VENDOR_mesh_instancing", "CESIUM_RTC"}) {
    gltf.more = std::string(R"("extensionsRequired":[")") + unknown + R"("],)";
    EXPECT_THAT(errorOf(gltf), HasSubstr(std::string("it requires the glTF extension ") + unknown));
  }
}

TEST_F(GltfFormat, quantizedPositions) {
  Gltf gltf;
  std::string data;
  for (const auto& corner : kCorners) {
    for (const int x : corner) append(data, std::int16_t(x));
    append(data, std::int16_t{0});
  }
  data += gltf.data.substr(48);
  gltf.data = data;
  gltf.positionBytes = 32;
  gltf.position = R"("componentType":5122)";
  std::string text = gltf.text();
  const std::string view = R"("byteLength":32)";
  text.replace(text.find(view), view.size(), R"("byteLength":32,"byteStride":8)");
  write("t.bin", gltf.data);
  MeshFormats::expectTetrahedron("t.gltf", text);
  // A normalized number stands for its share of 32767.
  text.replace(text.find(R"("componentType":5122)"), 20, R"("componentType":5122,"normalized":true)");
  EXPECT_DOUBLE_EQ(importMesh(write("t.gltf", text)).report.box.max().z(), 10.0 / 32767);
}

TEST_F(GltfFormat, sparseAccessors) {
  // The base has its second corner at (50, 60, 70); the sparse member puts it where it belongs.
  Gltf gltf;
  for (std::size_t c = 0; c < 3; ++c) {
    std::string number;
    append(number, float(10 * kCorners[0][c]));
    gltf.data.replace(12 + 4 * c, 4, number);
  }
  append(gltf.data, std::uint32_t{1});
  for (const int x : kCorners[1]) append(gltf.data, float(x));
  gltf.moreViews = R"(,{"buffer":0,"byteOffset":72,"byteLength":4},{"buffer":0,"byteOffset":76,"byteLength":12})";
  gltf.position = R"("componentType":5126,"sparse":{"count":1,"indices":{"bufferView":2,"componentType":5125},)"
                  R"("values":{"bufferView":3}})";
  expectTetrahedron(gltf);
  gltf.data[72] = 4;
  EXPECT_THAT(errorOf(gltf), HasSubstr("accessors[0].sparse has an index out of range"));
}

/// Returns the tetrahedron as Draco compresses it, without loss.
std::string dracoTetrahedron(draco::MeshEncoderMethod method) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(int(kFaces.size()));
  const int positions = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (std::uint32_t f = 0; f < kFaces.size(); ++f) {
    std::array<std::array<float, 3>, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) std::ranges::copy(kCorners[kFaces[f][i]], corners[i].begin());
    builder.SetAttributeValuesForFace(positions, draco::FaceIndex(f), corners[0].data(), corners[1].data(),
                                      corners[2].data());
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(method);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

TEST_F(GltfFormat, draco) {
  for (const auto method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    const std::string compressed = dracoTetrahedron(method);
    Gltf gltf;
    gltf.data += compressed;
    gltf.moreViews = R"(,{"buffer":0,"byteOffset":72,"byteLength":)" + std::to_string(compressed.size()) + "}";
    gltf.primitive = R"("extensions":{"KHR_draco_mesh_compression":{"bufferView":2,"attributes":{"POSITION":0}}},)";
    gltf.more = R"("extensionsRequired":["KHR_draco_mesh_compression"],)";
    for (std::size_t i = 0; i < 72; ++i) gltf.data[i] = 0;  // what a reader without the extension would take
    const MeshReport report = import(gltf).report;
    EXPECT_EQ(report.vertices, 4u);
    EXPECT_EQ(report.faces, 4u);
    EXPECT_EQ(report.boundaryEdges, 0u);
    EXPECT_EQ(report.volume, 1);
    EXPECT_EQ(report.box.min(), Vector3(5, 6, 7));
    EXPECT_EQ(report.box.max(), Vector3(6, 8, 10));

    Gltf cut = gltf;
    cut.moreViews = R"(,{"buffer":0,"byteOffset":72,"byteLength":20})";
    EXPECT_THAT(errorOf(cut), HasSubstr("cannot be decompressed"));
    Gltf unnamed = gltf;
    unnamed.primitive = R"("extensions":{"KHR_draco_mesh_compression":{"bufferView":2,"attributes":{"POSITION":7}}},)";
    EXPECT_THAT(errorOf(unnamed), HasSubstr("has no positions"));
  }
}

TEST_F(GltfFormat, instances) {
  Gltf gltf;
  for (const float x : {0.0f, 0.0f, 0.0f, 10.0f, 0.0f, 0.0f}) append(gltf.data, x);
  gltf.moreViews = R"(,{"buffer":0,"byteOffset":72,"byteLength":24})";
  gltf.moreAccessors = R"(,{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"})";
  gltf.nodes =
      R"({"mesh":0,"scale":[2,2,2],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2}}}})";
  gltf.more = R"("extensionsRequired":["EXT_mesh_gpu_instancing"],)";
  const MeshReport report = import(gltf).report;
  EXPECT_EQ(report.components, 2u);
  EXPECT_EQ(report.volume, 16);
  EXPECT_EQ(report.box.max(), Vector3(32, 16, 20));
}

TEST_F(GltfFormat, skinsAreLeftOut) {
  Gltf gltf;
  gltf.nodes = R"({"mesh":0,"skin":0},{})";
  gltf.more = R"("skins":[{"joints":[1]}],)";  // without inverse bind matrices
  expectTetrahedron(gltf);
}

/// Quaternions may differ from unit length by rounding, for instance as normalized bytes.
TEST_F(GltfFormat, rotationsKeepVolumes) {
  Gltf gltf;
  for (int i = 0; i < 4; ++i) append(gltf.data, std::int8_t{64});
  gltf.moreViews = R"(,{"buffer":0,"byteOffset":72,"byteLength":4})";
  gltf.moreAccessors = R"(,{"bufferView":2,"componentType":5120,"normalized":true,"count":1,"type":"VEC4"})";
  gltf.nodes = R"({"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"ROTATION":2}}}})";
  EXPECT_NEAR(import(gltf).report.volume, 1, 1e-12);
  gltf.nodes = R"({"mesh":0,"rotation":[0.6,0.6,0.6,0.6]})";
  EXPECT_NEAR(import(gltf).report.volume, 1, 1e-12);
  gltf.nodes = R"({"mesh":0,"rotation":[0,0,0,0]})";
  EXPECT_THAT(errorOf(gltf), HasSubstr("nodes[0] has a rotation by a quaternion of length 0"));
}

TEST_F(GltfFormat, stripsAndFans) {
  // The strip 0 2 1 3 0 2 has the faces 021, 123, 130 and 302, each turned as the tetrahedron's.
  Gltf gltf;
  gltf.data.resize(48);
  for (const int v : {0, 2, 1, 3, 0, 2}) append(gltf.data, std::uint16_t(v));
  gltf.data.resize(72);
  gltf.primitive = R"("mode":5,)";
  std::string text = gltf.text();
  text.replace(text.find(R"("count":12)"), 10, R"("count":6)");
  write("t.bin", gltf.data);
  MeshFormats::expectTetrahedron("t.gltf", text);
  text.replace(text.find(R"("mode":5)"), 8, R"("mode":6)");
  EXPECT_THAT(readMesh(write("t.gltf", text)).triangles,
              ElementsAre(Triangle{0, 2, 1}, Triangle{0, 1, 3}));  // the fan's other triangles have equal corners
}

TEST_F(GltfFormat, scenes) {
  Gltf gltf;
  gltf.nodes = R"({"mesh":0,"translation":[1,0,0]},{"children":[0]},{"mesh":0})";
  gltf.scenes = R"("scene":1,"scenes":[{"nodes":[1]},{"nodes":[2]}],)";
  expectTetrahedron(gltf);
  gltf.scenes = "";
  EXPECT_EQ(import(gltf).report.components, 2u) << "without scenes, all nodes without parents are shown";
  gltf.nodes = R"({"mesh":0,"children":[1]},{"children":[0]})";
  gltf.scenes = R"("scenes":[{"nodes":[0]}],)";
  EXPECT_THAT(errorOf(gltf), HasSubstr("nodes[0] occurs twice in the scene"));
}

TEST_F(GltfFormat, damagedFiles) {
  const auto with = [&](const std::function<void(Gltf&)>& change) {
    Gltf gltf;
    change(gltf);
    return errorOf(gltf);
  };
  EXPECT_THAT(with([](Gltf& g) { g.data.resize(60); }),
              HasSubstr("bufferViews[1] reaches beyond the end of its buffer"));
  EXPECT_THAT(with([](Gltf& g) { g.positionBytes = 40; }),
              HasSubstr("accessors[0] reaches beyond the end of its buffer view"));
  EXPECT_THAT(with([](Gltf& g) { g.attributes = R"("POSITION":7)"; }), HasSubstr("accessors has no item 7"));
  EXPECT_THAT(with([](Gltf& g) { g.attributes = R"("POSITION":-1)"; }),
              HasSubstr("POSITION is not a whole number from 0"));
  EXPECT_THAT(with([](Gltf& g) { g.position = R"("componentType":5124)"; }), HasSubstr("has an unknown componentType"));
  EXPECT_THAT(with([](Gltf& g) { g.nodes = R"({"mesh":0,"matrix":[1,2]})"; }),
              HasSubstr("nodes[0].matrix does not have 16 numbers"));
  EXPECT_THAT(with([](Gltf& g) { g.nodes = R"({"mesh":0,"scale":[1e308,1e308,1e308]},)"; }),
              HasSubstr("its JSON cannot be read"));
  EXPECT_THAT(with([](Gltf& g) { g.nodes = R"({"mesh":0,"scale":[1e308,1e308,1e308]})"; }),
              HasSubstr("is not a finite number"));
  EXPECT_THAT(with([](Gltf& g) { g.nodes = R"({"mesh":0,"scale":[1e400,1,1]})"; }),
              HasSubstr("its JSON has a number beyond the range of doubles"));
  const auto withIndices = [&](const std::string& accessor) {
    Gltf gltf;
    std::string text = gltf.text();
    const std::string old = R"("componentType":5123,"count":12)";
    text.replace(text.find(old), old.size(), accessor);
    write("t.bin", gltf.data);
    return MeshFormats::errorOf("t.gltf", text);
  };
  EXPECT_THAT(withIndices(R"("componentType":5123,"count":11)"), HasSubstr("has 11 corners, no multiple of three"));
  EXPECT_THAT(withIndices(R"("componentType":5126,"count":6)"), HasSubstr("has a type of numbers that are no indices"));
  EXPECT_THAT(withIndices(R"("componentType":5123,"normalized":true,"count":12)"), HasSubstr("that are no indices"));
  EXPECT_THAT(MeshFormats::errorOf("deep.gltf", std::string(200'000, '[')), HasSubstr("its JSON cannot be read"));
  EXPECT_THAT(MeshFormats::errorOf("t.gltf", R"({"asset":{"version":"1.0"}})"),
              HasSubstr("asset has a version other than 2.0"));
  Gltf elsewhere;
  std::string text = elsewhere.text();
  for (const char* other : {"https://example.org/t.bin", "/etc/hostname", "../t.bin", "a/%2E%2E/../t.bin"}) {
    std::string changed = text;
    changed.replace(changed.find("t%2Ebin"), 7, other);
    EXPECT_THAT(MeshFormats::errorOf("t.gltf", changed), HasSubstr("buffers[0] lies elsewhere")) << other;
  }
  std::string glb = "glTF";
  for (const std::uint32_t word : {1u, 12u}) append(glb, word);
  EXPECT_THAT(MeshFormats::errorOf("t.glb", glb), HasSubstr("a binary glTF file of version 1"));
  glb = "glTF";
  for (const std::uint32_t word : {2u, 1000u}) append(glb, word);
  EXPECT_THAT(MeshFormats::errorOf("t.glb", glb), HasSubstr("it promises 1000 bytes, but has only 12"));
}

TEST_F(GltfFormat, optionalExtensionsAreLeftOut) {
  Gltf gltf;
  std::string text = gltf.text();
  text.replace(text.find(R"("byteLength":48)"), 15, R"("byteLength":48,"extensions":{"EXT_meshopt_compression":{}})");
  write("t.bin", gltf.data);
  MeshFormats::expectTetrahedron("t.gltf", text);
}

/// Bytes that begin like those of gzip are no compressed file if the name does not say so.
TEST_F(GltfFormat, buffersMayBeginLikeCompressedFiles) {
  Gltf gltf;
  const std::uint32_t bits = 0x00008b1f;  // a denormal float
  std::string first;
  append(first, bits);
  gltf.data.replace(0, 4, first);
  EXPECT_EQ(import(gltf).mesh.vertices[0].x(), double{std::bit_cast<float>(bits)});
}

TEST_F(GltfFormat, buffersAsBase64) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const Gltf gltf;
  std::string base64;
  for (std::size_t i = 0; i < gltf.data.size(); i += 3) {  // 72 bytes, a multiple of three
    std::uint32_t bits = 0;
    for (std::size_t b = 0; b < 3; ++b) bits = bits << 8 | static_cast<unsigned char>(gltf.data[i + b]);
    for (int shift = 18; shift >= 0; shift -= 6) base64 += kDigits[bits >> shift & 63];
  }
  std::string text = gltf.text();
  text.replace(text.find("t%2Ebin"), 7, "data:application/octet-stream;base64," + base64);
  MeshFormats::expectTetrahedron("t.gltf", text);
  std::string escaped = text;
  escaped.replace(escaped.find("data:"), 5, "DATA:");
  escaped.replace(escaped.find("AAA"), 3, "A%41A");
  MeshFormats::expectTetrahedron("t.gltf", escaped);
  text[text.find(";base64,") + 9] = '?';
  EXPECT_THAT(MeshFormats::errorOf("t.gltf", text), HasSubstr("buffers[0] has data that are not base64"));
}

}  // namespace mesh_formats_test
}  // namespace hpsdf
