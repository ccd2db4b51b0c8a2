#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <vector>

#include "gl/egl_context.h"
#include "gl/field_upload.h"
#include "gl/gl_objects.h"
#include "gl/program.h"
#include "gl/tiles.h"
#include "hpsdf/error.h"
#include "hpsdf/render/renderer.h"
#include "view/grid_space.h"
#include "view/scaled_renderer.h"
#include "view/surface_blocks.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace {

static_assert(kTile % kBlock == 0);

/// Locations of the uniforms, as in shaders/.
enum : GLint { kGrid = 0, kFirstPixel, kSize };
enum : GLint { kSliceOrigin = 3, kSliceRight, kSliceUp, kSliceStep };
enum : GLint { kEye = 3, kForward, kRight, kUp, kScale, kRayStep, kOffset, kDiagonal, kMostSteps, kResume };
enum : GLint { kShownLo = 15, kShownHi, kParallel, kBlend, kTogetherSteps };
enum : GLint { kViewport = 13, kStartSide };
constexpr GLint kMostRefinements = kMostSteps;

constexpr int kStepsInAll = 1 << 16;  // of a ray, as on the CPU
constexpr int kRefinementsInAll = 24;

/// llvmpipe ends all loops of a shader once they have run 65535 times together; some are left for the compiler's own.
constexpr int kLoopBudget = 60000;

/// Runs of the loops of one evaluation, each loop's last test counted.
constexpr int evaluationLoops(int degree) {
  const int rows = (degree + 1) * (degree + 2) / 2;
  return coefficientCount(degree) + 2 * rows + 2 * (degree + 1) + 1;
}

/// The same near a face: at each depth eight places, down to which the first have to descend, and leaves that are
/// evaluated, of which sixteen are near the point at most.
constexpr int blendedLoops(int evaluation) { return 9 * (kMaxDepth + 1) + 9 * (kMaxDepth + 1) + 16 * evaluation + 2; }

using Texel = std::array<std::uint32_t, 4>;
using NormalTexel = std::array<float, 4>;

/// A tile's pair of render targets: four integers and four floats a pixel.
class Target {
 public:
  Target(int width, int height) {
    glTextureStorage2D(integers_.name(), 1, GL_RGBA32UI, width, height);
    glTextureStorage2D(floats_.name(), 1, GL_RGBA32F, width, height);
    for (const GLuint texture : {integers_.name(), floats_.name()}) {
      // a texture of integers cannot be read with the filters that are the default
      glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
      glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    glNamedFramebufferTexture(framebuffer_.name(), GL_COLOR_ATTACHMENT0, integers_.name(), 0);
    glNamedFramebufferTexture(framebuffer_.name(), GL_COLOR_ATTACHMENT1, floats_.name(), 0);
    constexpr GLenum kBoth[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glNamedFramebufferDrawBuffers(framebuffer_.name(), 2, kBoth);
    if (glCheckNamedFramebufferStatus(framebuffer_.name(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw Error("the OpenGL device cannot render into 32-bit buffers: update its driver, or render with --cpu");
  }

  void bindForDrawing() const { glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name()); }

  /// All pixels to no cell and no normal.
  void clear() const {
    constexpr GLuint kNothing[] = {kNoCell, 0, 0, 0};
    constexpr GLfloat kZero[] = {0, 0, 0, 0};
    glClearNamedFramebufferuiv(framebuffer_.name(), GL_COLOR, 0, kNothing);
    glClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, 1, kZero);
  }

  /// As textures of units 2 and 3.
  void bindForReading() const {
    glBindTextureUnit(2, integers_.name());
    glBindTextureUnit(3, floats_.name());
  }

  void readIntegers(int width, int height, std::vector<Texel>& out) const {
    out.resize(std::size_t(width) * height);
    glNamedFramebufferReadBuffer(framebuffer_.name(), GL_COLOR_ATTACHMENT0);
    glReadPixels(0, 0, width, height, GL_RGBA_INTEGER, GL_UNSIGNED_INT, out.data());
  }

  void readFloats(int width, int height, std::vector<NormalTexel>& out) const {
    out.resize(std::size_t(width) * height);
    glNamedFramebufferReadBuffer(framebuffer_.name(), GL_COLOR_ATTACHMENT1);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, out.data());
  }

 private:
  GlTexture2D integers_, floats_;
  GlFramebuffer framebuffer_;
};

/// The smallest part of a view that holds all blocks, of which there is one at least.
Tile partWith(const std::vector<Block>& blocks, int width, int height) {
  const auto [left, right] = std::ranges::minmax(blocks, {}, &Block::x);
  const auto [top, bottom] = std::ranges::minmax(blocks, {}, &Block::y);
  const int x = static_cast<int>(left.x);
  const int y = static_cast<int>(top.y);
  return {x, y, std::min(width, int(right.x) + kBlock) - x, std::min(height, int(bottom.y) + kBlock) - y};
}

/// The octree alone.
FieldData withoutCoefficients(const FieldData& field) {
  return {.domain = field.domain,
          .grid = field.grid,
          .nodes = field.nodes,
          .coefficients = {},
          .blend = 0,
          .bounds = {},
          .metadata = {}};
}

int highestDegree(const FieldData& field) {
  int degree = 0;
  for (const std::uint64_t bits : field.nodes)
    if (node::isLeaf(bits)) degree = std::max(degree, node::degree(bits));
  return degree;
}

/// Everything on the device. Made and destroyed with the context current.
struct Resources {
  Resources(const Field& whole, const std::vector<NodeBounds>& bounds, const std::vector<ZoneBounds>& zones)
      : field(whole, bounds, zones),
        slice(linkedProgram({"full_screen.vert"}, {"field.glsl", leaves(whole), "slice.frag"})),
        march(linkedProgram({"surface.vert"}, {"field.glsl", leaves(whole), "surface.glsl", "surface_march.frag"})),
        hit(linkedProgram({"surface.vert"}, {"field.glsl", leaves(whole), "surface.glsl", "surface_hit.frag"})) {
    const FieldData& data = whole.data();
    for (const GlProgram* program : {&slice, &march, &hit}) {
      glProgramUniform3ui(program->name(), kGrid, data.grid[0], data.grid[1], data.grid[2]);
      if (data.blend > 0) glProgramUniform1f(program->name(), kBlend, static_cast<float>(data.blend));
    }
    glEnableVertexArrayAttrib(blocks.name(), 0);
    glVertexArrayAttribFormat(blocks.name(), 0, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(blocks.name(), 0, 0);
  }

  static std::string_view leaves(const Field& field) {
    return field.data().blend > 0 ? "leaves_blended.glsl" : "leaves_alone.glsl";
  }

  FieldUpload field;
  GlProgram slice, march, hit;
  GlVertexArray noVertices, blocks;
  GlQuery anyPixels;
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
  GlRenderer(const Field& field, GlChoice choice)
      : context_(choice), space_(field.data()), octree_(withoutCoefficients(field.data())) {
    const std::vector<ZoneBounds> zones = zoneBounds(field);
    bounds_ = nodeBounds(field.data(), zones);
    const int alone = evaluationLoops(highestDegree(field.data()));
    const int evaluation = zones.empty() ? alone : blendedLoops(alone);
    const int ofStep = alone + kMaxDepth + 4;
    stepsInPass_ = std::max(1, kLoopBudget / ofStep);
    refinements_ = std::clamp((kLoopBudget - kMaxDepth) / (evaluation + 1) - 1, 1, kRefinementsInAll);
    const EglContext::Current current(context_);
    resources_ = std::make_unique<Resources>(field, bounds_, zones);
    if (!zones.empty()) glProgramUniform1i(resources_->march.name(), kTogetherSteps, evaluation / ofStep);
  }

  ~GlRenderer() override {
    try {
      const EglContext::Current current(context_);
      resources_.reset();
    } catch (const Error&) {
      // current on another thread: what is on the device goes with the context
      static_cast<void>(resources_.release());
    }
  }

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
    const Target target(std::min(width, kTile), std::min(height, kTile));
    prepare();
    glUseProgram(program.name());
    glBindVertexArray(resources_->noVertices.name());
    for (const Tile& tile : tiles({0, 0, width, height})) {
      glViewport(0, 0, tile.width, tile.height);
      glProgramUniform2i(program.name(), kFirstPixel, tile.left, tile.top);
      target.bindForDrawing();
      glDrawArrays(GL_TRIANGLES, 0, 3);
      target.readIntegers(tile.width, tile.height, integers_);
      forEachPixel(tile, width, [&](std::size_t from, std::size_t to) {
        const Texel& texel = integers_[from];
        buffers.cell[to] = texel[0];
        buffers.degree[to] = static_cast<std::uint8_t>(texel[1]);
        buffers.depth[to] = static_cast<std::uint8_t>(texel[2]);
        buffers.value[to] = std::bit_cast<float>(texel[3]);
      });
    }
    checkGl("draw a slice");
    return buffers;
  }

  ViewBuffers surface(const SurfaceView& view, int width, int height) override {
    checkOffset(view.offset);
    const RayGeometry rays(space_, view.camera, width, height, view.clip);
    const EglContext::Current current(context_);
    setRays(resources_->march, rays, view.offset, space_.diagonal);
    setRays(resources_->hit, rays, view.offset, space_.diagonal);
    glProgramUniform1i(resources_->march.name(), kMostSteps, stepsInPass_);
    glProgramUniform1i(resources_->hit.name(), kMostRefinements, refinements_);

    ViewBuffers buffers = emptyBuffers(width, height, true);
    const SurfaceBlocks found = surfaceBlocks(octree_, bounds_, space_, rays, view.offset);
    if (found.blocks.empty()) return buffers;
    const GlBuffer blocks;
    glNamedBufferStorage(blocks.name(), GLsizeiptr(found.blocks.size() * sizeof(Block)), found.blocks.data(), 0);
    glVertexArrayVertexBuffer(resources_->blocks.name(), 0, blocks.name(), 0, sizeof(Block));
    glProgramUniform1f(resources_->march.name(), kStartSide, found.side);

    const Tile part = partWith(found.blocks, width, height);
    const Target state(std::min(part.width, kTile), std::min(part.height, kTile));
    const Target target(std::min(part.width, kTile), std::min(part.height, kTile));
    prepare();
    glBindVertexArray(resources_->blocks.name());
    glEnable(GL_PROGRAM_POINT_SIZE);
    state.bindForReading();
    for (const Tile& tile : tiles(part)) {
      setTile(tile);
      const GLsizei count = static_cast<GLsizei>(found.blocks.size());
      state.bindForDrawing();
      march(count);
      target.clear();
      hit(target, count);
      target.readIntegers(tile.width, tile.height, integers_);
      if (std::ranges::any_of(integers_, isUnderWay)) {
        state.bindForDrawing();
        marchOn(count);
        hit(target, count);
        target.readIntegers(tile.width, tile.height, integers_);
      }
      target.readFloats(tile.width, tile.height, normals_);
      forEachPixel(tile, width, [&](std::size_t from, std::size_t to) {
        const Texel& texel = integers_[from];
        buffers.cell[to] = texel[0];
        buffers.degree[to] = static_cast<std::uint8_t>(texel[1] & 0xff);
        buffers.depth[to] = static_cast<std::uint8_t>(texel[1] >> 8 & 0xff);
        buffers.crack[to] = static_cast<std::uint8_t>(texel[1] >> 16);
        buffers.value[to] = std::bit_cast<float>(texel[2]);
        buffers.distance[to] = std::bit_cast<float>(texel[3]);
        buffers.normal[to] = {normals_[from][0], normals_[from][1], normals_[from][2]};
      });
    }
    checkGl("trace a surface");
    return buffers;
  }

  std::string description() const override { return context_.renderer(); }

 private:
  void prepare() const {
    resources_->field.bind();
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
  }

  void setTile(const Tile& tile) const {
    // whole blocks, since a point whose centre lies outside is not drawn
    const auto up = [](int pixels) { return (pixels + kBlock - 1) / kBlock * kBlock; };
    glViewport(0, 0, up(tile.width), up(tile.height));
    for (const GlProgram* program : {&resources_->march, &resources_->hit}) {
      glProgramUniform2i(program->name(), kFirstPixel, tile.left, tile.top);
      glProgramUniform2i(program->name(), kViewport, up(tile.width), up(tile.height));
    }
  }

  void march(GLsizei blocks) const {
    glUseProgram(resources_->march.name());
    glProgramUniform1i(resources_->march.name(), kResume, GL_FALSE);
    glDrawArrays(GL_POINTS, 0, blocks);
    glTextureBarrier();
  }

  /// Draws the march again until no pixel is under way, or all steps are used up.
  void marchOn(GLsizei blocks) const {
    const GLuint query = resources_->anyPixels.name();
    glUseProgram(resources_->march.name());
    glProgramUniform1i(resources_->march.name(), kResume, GL_TRUE);
    for (int steps = stepsInPass_; steps < kStepsInAll; steps += stepsInPass_) {
      glBeginQuery(GL_ANY_SAMPLES_PASSED, query);
      glDrawArrays(GL_POINTS, 0, blocks);
      glEndQuery(GL_ANY_SAMPLES_PASSED);
      // the pass reads the texels that the one before has written, each pixel its own
      glTextureBarrier();
      GLuint any = GL_FALSE;
      glGetQueryObjectuiv(query, GL_QUERY_RESULT, &any);
      if (any == GL_FALSE) break;
    }
  }

  void hit(const Target& target, GLsizei blocks) const {
    target.bindForDrawing();
    glUseProgram(resources_->hit.name());
    glDrawArrays(GL_POINTS, 0, blocks);
  }

  /// Whether the march of a pixel of the hit pass goes on.
  static bool isUnderWay(const Texel& texel) { return texel[0] == kNoCell && texel[1] != 0; }

  /// Calls f with each pixel's place in the tile and in the view. Rows of a target run downwards, as those of a view.
  template <typename F>
  static void forEachPixel(const Tile& tile, int viewWidth, F&& f) {
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x)
        f(std::size_t(y) * tile.width + x, std::size_t(tile.top + y) * viewWidth + tile.left + x);
  }

  EglContext context_;
  GridSpace space_;
  FieldData octree_;
  std::vector<NodeBounds> bounds_;
  std::unique_ptr<Resources> resources_;
  int stepsInPass_;  ///< of a ray, in one pass
  int refinements_;
  std::vector<Texel> integers_;
  std::vector<NormalTexel> normals_;
};

}  // namespace

std::unique_ptr<Renderer> makeGlRenderer(const Field& field, GlChoice choice) {
  return inUnitsNearOne(field, [&](const Field& near) { return std::make_unique<GlRenderer>(near, choice); });
}

std::string glDescription(GlChoice choice) { return EglContext(choice).renderer(); }

}  // namespace hpsdf::render
