#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "gl/egl_context.h"
#include "gl/field_upload.h"
#include "gl/gl_objects.h"
#include "gl/render_target.h"
#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/render/renderer.h"
#include "view/grid_space.h"
#include "view/scaled_renderer.h"
#include "view/surface_blocks.h"
#include "view/view_buffers.h"
#include "view/view_checks.h"

namespace hpsdf::render {
namespace {

constexpr int kBlocksInRow = kTile / kBlock;  // blocks beside each other in a render target
constexpr std::size_t kMostBlocks = std::size_t(kBlocksInRow) * kBlocksInRow;

/// The locations of the uniforms in the shaders.
enum : GLint { kGrid = 0, kFirstPixel, kSize };
enum : GLint { kSliceOrigin = 3, kSliceRight, kSliceUp, kSliceStep };
enum : GLint { kEye = 3, kForward, kRight, kUp, kScale, kRayStep, kOffset, kDiagonal, kMostSteps, kResume };
enum : GLint { kShownLo = 15, kShownHi, kParallel, kBlend, kBlendedSteps };
enum : GLint { kFirstBlock = 1, kViewport = 13, kStartSide };
enum : GLint { kBaseCell = 20, kExactOffset, kAtTriangles };
constexpr GLint kRefinementLimit = kMostSteps;

constexpr int kStepsInAll = 1 << 16;  // greatest number of steps of a ray, as on the CPU
constexpr int kRefinementsInAll = 24;

/// Greatest total number of loop iterations in one run of a shader. llvmpipe silently ends all loops of a shader once
/// the sum of their iterations is 65535, and loops that the compiler adds count too.
constexpr int kLoopBudget = 60000;

/// The number of loop iterations in the evaluation of one leaf's polynomial, including the last test of each loop.
constexpr int evaluationLoops(int degree) {
  const int rows = (degree + 1) * (degree + 2) / 2;
  return coefficientCount(degree) + 2 * rows + 2 * (degree + 1) + 1;
}

/// The number of loop iterations in one evaluation of the blended field: the search through eight candidate nodes at
/// each depth, the descent to the first candidates, and the evaluation of at most sixteen leaves.
constexpr int blendedEvaluationLoops(int evaluation) {
  return 9 * (kMaxDepth + 1) + 9 * (kMaxDepth + 1) + 16 * evaluation + 2;
}

using Texel = std::array<std::uint32_t, 4>;
using NormalTexel = std::array<float, 4>;

/// The part of a render target in which blocks stand in rows.
Tile tileOf(std::size_t blocks) {
  return {0, 0, kTile, static_cast<int>((blocks + kBlocksInRow - 1) / kBlocksInRow) * kBlock};
}

int highestDegree(const FieldData& field) {
  int degree = 0;
  for (const std::uint64_t bits : field.nodes)
    if (node::isLeaf(bits) && !node::isExact(bits)) degree = std::max(degree, node::degree(bits));
  return degree;
}

/// The greatest number of loop iterations in a search through the list of an exact leaf; 0 without exact leaves.
int longestSearch(const FieldData& field) {
  int longest = 0;
  for (const std::uint64_t bits : field.nodes) {
    if (!node::isExact(bits)) continue;
    int iterations = 1;
    TriangleListView(field.exact, bits).forEachRun([&](std::uint32_t run) {
      iterations += int(triangle_run::length(run)) + 2;
    });
    longest = std::max(longest, iterations);
  }
  return longest;
}

/// The OpenGL objects of the renderer. Their context must be current when they are created and destroyed.
struct Resources {
  Resources(const Field& whole, const std::vector<SurfaceBounds>& bounds, const std::vector<BlendZoneBounds>& zones)
      : field(whole, bounds, zones),
        slice(linkedProgram({"full_screen.vert"}, {"field.glsl", functions(whole), leaves(whole), "slice.frag"})),
        march(linkedProgram({"surface.vert"},
                            {"field.glsl", functions(whole), leaves(whole), "surface.glsl", "surface_march.frag"})),
        hit(linkedProgram({"surface.vert"},
                          {"field.glsl", functions(whole), leaves(whole), "surface.glsl", "surface_hit.frag"})) {
    const FieldData& data = whole.data();
    for (const GlProgram* program : {&slice, &march, &hit}) {
      glProgramUniform3ui(program->name(), kGrid, data.grid[0], data.grid[1], data.grid[2]);
      if (!data.exact.empty()) setExactLeaves(*program, data);
      if (data.blend > 0) glProgramUniform1f(program->name(), kBlend, static_cast<float>(data.blend));
    }
    glEnableVertexArrayAttrib(blocks.name(), 0);
    glVertexArrayAttribFormat(blocks.name(), 0, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(blocks.name(), 0, 0);
    glEnableVertexArrayAttrib(blocks.name(), 1);
    glVertexArrayAttribIFormat(blocks.name(), 1, 2, GL_UNSIGNED_INT, offsetof(Block, chosen));
    glVertexArrayAttribBinding(blocks.name(), 1, 0);
  }

  static void setExactLeaves(const GlProgram& program, const FieldData& data) {
    const GridSpace space(data);
    const Eigen::Vector3f cell = space.size.cwiseQuotient(space.grid).cast<float>();
    glProgramUniform3f(program.name(), kBaseCell, cell.x(), cell.y(), cell.z());
    glProgramUniform1f(program.name(), kExactOffset, static_cast<float>(data.exact.offset));
  }

  /// The shader file for the functions of single leaves, with or without exact leaves.
  static std::string_view functions(const Field& field) {
    return field.data().exact.empty() ? "leaves_polynomial.glsl" : "leaves_exact.glsl";
  }

  /// The shader file for the evaluation of the field, with or without blending.
  static std::string_view leaves(const Field& field) {
    return field.data().blend > 0 ? "leaves_blended.glsl" : "leaves_alone.glsl";
  }

  FieldUpload field;
  GlProgram slice, march, hit;
  GlVertexArray noVertices, blocks;
  GlQuery anyPixels;
  std::optional<RenderTarget> state, target;
};

void setVector(const GlProgram& program, GLint location, const Vector3& v) {
  glProgramUniform3d(program.name(), location, v.x(), v.y(), v.z());
}

void setSize(const GlProgram& program, int width, int height) {
  glProgramUniform2i(program.name(), kSize, width, height);
}

void setRays(const GlProgram& program, const RayGeometry& rays, double offset, double diagonal) {
  setSize(program, rays.width, rays.height);
  setVector(program, kEye, rays.eye);
  setVector(program, kForward, rays.forward);
  setVector(program, kRight, rays.right);
  setVector(program, kUp, rays.up);
  setVector(program, kScale, rays.scale);
  setVector(program, kShownLo, rays.lo);
  setVector(program, kShownHi, rays.hi);
  glProgramUniform1i(program.name(), kParallel, rays.parallel);
  glProgramUniform2d(program.name(), kRayStep, rays.stepX, rays.stepY);
  glProgramUniform1f(program.name(), kOffset, static_cast<float>(offset));
  glProgramUniform1f(program.name(), kDiagonal, static_cast<float>(diagonal));
}

class GlRenderer final : public Renderer {
 public:
  GlRenderer(const Field& field, GlChoice choice) : context_(choice), space_(field.data()) {
    octree_.grid = field.grid();
    octree_.nodes = field.data().nodes;
    if (!field.data().exact.empty()) triangleLevel_ = -field.data().exact.offset;
    const std::vector<BlendZoneBounds> zones = blendZoneBounds(field);
    bounds_ = surfaceBounds(field.data(), zones);
    // Limit the steps and the root refinements in one pass, so that the shaders stay within kLoopBudget.
    const int search = longestSearch(field.data());
    const int unblended = evaluationLoops(highestDegree(field.data())) + search;
    const int evaluation = zones.empty() ? unblended : blendedEvaluationLoops(unblended);
    const int loopsOfStep = unblended + search + kMaxDepth + 4;
    stepsInPass_ = std::max(1, kLoopBudget / loopsOfStep);
    refinements_ = std::clamp((kLoopBudget - kMaxDepth) / (evaluation + 1) - 1, 1, kRefinementsInAll);
    const EglContext::Current current(context_);
    resources_ = std::make_unique<Resources>(field, bounds_, zones);
    if (!zones.empty()) glProgramUniform1i(resources_->march.name(), kBlendedSteps, evaluation / loopsOfStep);
  }

  ~GlRenderer() override { deleteObjects(context_, resources_); }

  ViewBuffers slice(const SliceView& view, int width, int height) override {
    const SliceGeometry geometry(space_, view, width, height);
    const EglContext::Current current(context_);
    const GlProgram& program = resources_->slice;
    setSize(program, width, height);
    setVector(program, kSliceOrigin, geometry.origin);
    setVector(program, kSliceRight, geometry.right);
    setVector(program, kSliceUp, geometry.up);
    glProgramUniform2d(program.name(), kSliceStep, geometry.stepX, geometry.stepY);

    ViewBuffers buffers = emptyBuffers(width, height, false);
    const Tile whole{0, 0, width, height};
    const RenderTarget& target = keptTarget(resources_->target, whole);
    target.bindForDrawing();
    resources_->field.bind();
    glUseProgram(program.name());
    glBindVertexArray(resources_->noVertices.name());
    for (const Tile& tile : tiles(whole)) {
      glViewport(0, 0, tile.width, tile.height);
      glProgramUniform2i(program.name(), kFirstPixel, tile.left, tile.top);
      glDrawArrays(GL_TRIANGLES, 0, 3);
      target.read(tile, integers_);
      forEachPixel(tile, [&](std::size_t from, int x, int y) {
        const Texel& texel = integers_[from];
        const std::size_t to = std::size_t(y) * width + x;
        buffers.cell[to] = texel[0];
        buffers.degree[to] = static_cast<std::uint8_t>(texel[1]);
        buffers.depth[to] = static_cast<std::uint8_t>(texel[2]);
        buffers.value[to] = std::bit_cast<float>(texel[3]);
      });
    }
    checkGl("draw a slice");
    return buffers;
  }

  ViewBuffers surface(const SurfaceView& view, int width, int height, std::span<const std::uint8_t> chosen) override {
    checkOffset(view.offset);
    checkChosen(chosen, width, height);
    const RayGeometry rays(space_, view.camera, width, height, view.clip);
    const EglContext::Current current(context_);
    setRays(resources_->march, rays, view.offset, space_.diagonal);
    setRays(resources_->hit, rays, view.offset, space_.diagonal);
    glProgramUniform1i(resources_->march.name(), kMostSteps, stepsInPass_);
    if (triangleLevel_) glProgramUniform1i(resources_->march.name(), kAtTriangles, view.offset == *triangleLevel_);
    glProgramUniform1i(resources_->hit.name(), kRefinementLimit, refinements_);

    // Find the blocks of pixels that may see the surface, and upload them.
    ViewBuffers buffers = emptyBuffers(width, height, true);
    SurfaceBlocks found = surfaceBlocks(octree_, bounds_, space_, rays, view.offset);
    keepChosen(chosen, width, height, found.blocks);
    if (found.blocks.empty()) return buffers;
    const GlBuffer blocks;
    glNamedBufferStorage(blocks.name(), GLsizeiptr(found.blocks.size() * sizeof(Block)), found.blocks.data(), 0);
    glVertexArrayVertexBuffer(resources_->blocks.name(), 0, blocks.name(), 0, sizeof(Block));
    glProgramUniform1f(resources_->march.name(), kStartSide, found.side);

    // Draw the blocks, as many at a time as a render target holds.
    const Tile most = tileOf(std::min(found.blocks.size(), kMostBlocks));
    const RenderTarget &state = keptTarget(resources_->state, most), &target = keptTarget(resources_->target, most);
    resources_->field.bind();
    glBindVertexArray(resources_->blocks.name());
    glEnable(GL_PROGRAM_POINT_SIZE);
    state.bindForReading();
    for (std::size_t first = 0; first < found.blocks.size(); first += kMostBlocks) {
      const Blocks drawn{GLint(first), GLsizei(std::min(found.blocks.size() - first, kMostBlocks))};
      drawBlocks(drawn, state, target);
      tbb::parallel_for(0, drawn.count, [&](int i) { setBlock(i, found.blocks[first + std::size_t(i)], buffers); });
    }
    checkGl("trace a surface");
    return buffers;
  }

  std::string description() const override { return context_.renderer(); }

 private:
  /// Blocks that are drawn together.
  struct Blocks {
    GLint first;
    GLsizei count;
  };

  /// Traces the rays of blocks and reads the hits. The first march pass starts all rays. Further march passes continue
  /// only the rays whose march has not ended.
  void drawBlocks(const Blocks& blocks, const RenderTarget& state, const RenderTarget& target) {
    const Tile tile = tileOf(std::size_t(blocks.count));
    glViewport(0, 0, tile.width, tile.height);
    for (const GlProgram* program : {&resources_->march, &resources_->hit}) {
      glProgramUniform1i(program->name(), kFirstBlock, blocks.first);
      glProgramUniform2i(program->name(), kViewport, tile.width, tile.height);
    }
    state.bindForDrawing();
    march(blocks);
    target.clear(tile);
    hit(target, blocks);
    target.read(tile, integers_);
    const std::span all(integers_.data(), std::size_t(tile.width) * tile.height);
    if (std::ranges::any_of(all, isUnderWay)) {
      state.bindForDrawing();
      continueMarch(blocks);
      hit(target, blocks);
      target.read(tile, integers_);
    }
    target.read(tile, normals_);
  }

  void march(const Blocks& blocks) const {
    glUseProgram(resources_->march.name());
    glProgramUniform1i(resources_->march.name(), kResume, GL_FALSE);
    glDrawArrays(GL_POINTS, blocks.first, blocks.count);
    glTextureBarrier();
  }

  /// Repeats the march pass until the march of every pixel has ended or all steps are used up.
  void continueMarch(const Blocks& blocks) const {
    const GLuint query = resources_->anyPixels.name();
    glUseProgram(resources_->march.name());
    glProgramUniform1i(resources_->march.name(), kResume, GL_TRUE);
    for (int steps = stepsInPass_; steps < kStepsInAll; steps += stepsInPass_) {
      glBeginQuery(GL_ANY_SAMPLES_PASSED, query);
      glDrawArrays(GL_POINTS, blocks.first, blocks.count);
      glEndQuery(GL_ANY_SAMPLES_PASSED);
      // Each march pass reads the texels that the previous pass has written. Each pixel reads only its own texel.
      glTextureBarrier();
      GLuint any = GL_FALSE;
      glGetQueryObjectuiv(query, GL_QUERY_RESULT, &any);
      if (any == GL_FALSE) break;
    }
  }

  void hit(const RenderTarget& target, const Blocks& blocks) const {
    target.bindForDrawing();
    glUseProgram(resources_->hit.name());
    glDrawArrays(GL_POINTS, blocks.first, blocks.count);
  }

  /// Returns true if the march of a pixel has not ended, given the texel that the hit pass wrote for this pixel.
  static bool isUnderWay(const Texel& texel) { return texel[0] == kNoCell && texel[1] != 0; }

  /// Copies block i of those that were drawn last to the view's buffers.
  void setBlock(int i, const Block& block, ViewBuffers& buffers) const {
    const int left = static_cast<int>(block.x), top = static_cast<int>(block.y);
    const std::size_t corner = std::size_t(i / kBlocksInRow) * kBlock * kTile + std::size_t(i % kBlocksInRow) * kBlock;
    for (int y = 0; y < std::min(kBlock, buffers.height - top); ++y)
      for (int x = 0; x < std::min(kBlock, buffers.width - left); ++x)
        setPixel(corner + std::size_t(y) * kTile + x, buffers, std::size_t(top + y) * buffers.width + left + x);
  }

  /// Copies the pixel `from` of the blocks that were drawn last to the pixel `to` of the view's buffers.
  void setPixel(std::size_t from, ViewBuffers& buffers, std::size_t to) const {
    const Texel& texel = integers_[from];
    buffers.cell[to] = texel[0];
    buffers.degree[to] = static_cast<std::uint8_t>(texel[1] & 0xff);
    buffers.depth[to] = static_cast<std::uint8_t>(texel[1] >> 8 & 0xff);
    buffers.crack[to] = static_cast<std::uint8_t>(texel[1] >> 16);
    buffers.value[to] = std::bit_cast<float>(texel[2]);
    buffers.distance[to] = std::bit_cast<float>(texel[3]);
    buffers.normal[to] = {normals_[from][0], normals_[from][1], normals_[from][2]};
  }

  EglContext context_;
  GridSpace space_;
  FieldData octree_;  ///< the field's octree, without coefficients
  std::vector<SurfaceBounds> bounds_;
  std::unique_ptr<Resources> resources_;
  std::optional<double> triangleLevel_;  ///< value of the field on the triangles of exact leaves, if it has such leaves
  int stepsInPass_;                      ///< greatest number of steps of a ray in one pass of the march
  int refinements_;                      ///< greatest number of iterations that refine a root
  std::vector<Texel> integers_;          ///< integer outputs of the shaders for the last tile or blocks
  std::vector<NormalTexel> normals_;     ///< normals for the last blocks
};

}  // namespace

std::unique_ptr<Renderer> makeGlRenderer(const Field& field, GlChoice choice) {
  return inUnitsNearOne(field, [&](const Field& near) { return std::make_unique<GlRenderer>(near, choice); });
}

std::string glDescription(GlChoice choice) { return EglContext(choice).renderer(); }

}  // namespace hpsdf::render
