#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <vector>

#include "gl/egl_context.h"
#include "gl/field_upload.h"
#include "gl/gl_objects.h"
#include "gl/program.h"
#include "grid_space.h"
#include "hpsdf/error.h"
#include "hpsdf/render/renderer.h"
#include "view_buffers.h"

namespace hpsdf::render {
namespace {

constexpr int kTile = 2048;  // pixels a side: larger views are drawn in tiles, so that any size fits the device

/// Locations of the uniforms, as in shaders/.
enum : GLint { kGrid = 0, kFirstPixel, kSize };
enum : GLint { kSliceOrigin = 3, kSliceRight, kSliceUp, kSliceStep };
enum : GLint { kEye = 3, kForward, kRight, kUp, kScale, kRayStep, kOffset, kDiagonal, kMostSteps, kResume };
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

/// A part of a view that is drawn at once.
struct Tile {
  int left, top, width, height;
};

std::vector<Tile> tiles(int width, int height) {
  std::vector<Tile> result;
  for (int top = 0; top < height; top += kTile)
    for (int left = 0; left < width; left += kTile)
      result.push_back({left, top, std::min(kTile, width - left), std::min(kTile, height - top)});
  return result;
}

int highestDegree(const FieldData& field) {
  int degree = 0;
  for (const std::uint64_t bits : field.nodes)
    if (node::isLeaf(bits)) degree = std::max(degree, node::degree(bits));
  return degree;
}

void checkGl(const char* what) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw Error(std::string("the OpenGL device fails to ") + what + " (error " + std::to_string(error) +
              "): render a smaller picture, or with --cpu");
}

/// Everything on the device. Made and destroyed with the context current.
struct Resources {
  explicit Resources(const FieldData& data)
      : field(data),
        slice(fullScreenProgram({"field.glsl", "slice.frag"})),
        march(fullScreenProgram({"field.glsl", "surface.glsl", "surface_march.frag"})),
        hit(fullScreenProgram({"field.glsl", "surface.glsl", "surface_hit.frag"})) {
    for (const GlProgram* program : {&slice, &march, &hit})
      glProgramUniform3ui(program->name(), kGrid, data.grid[0], data.grid[1], data.grid[2]);
  }

  FieldUpload field;
  GlProgram slice, march, hit;
  GlVertexArray noVertices;
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
  glProgramUniform2d(program.name(), kRayStep, rays.stepX, rays.stepY);
  glProgramUniform1f(program.name(), kOffset, static_cast<float>(offset));
  glProgramUniform1f(program.name(), kDiagonal, static_cast<float>(diagonal));
}

void drawTile(const GlProgram& program, const Tile& tile) {
  glProgramUniform2i(program.name(), kFirstPixel, tile.left, tile.top);
  glUseProgram(program.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

class GlRenderer final : public Renderer {
 public:
  GlRenderer(const Field& field, GlChoice choice) : context_(choice), space_(field.data()) {
    const int evaluation = evaluationLoops(highestDegree(field.data()));
    stepsInPass_ = kLoopBudget / (2 * evaluation + kMaxDepth + 3);
    refinements_ = std::min(kRefinementsInAll, (kLoopBudget - kMaxDepth) / (evaluation + 1) - 1);
    const EglContext::Current current(context_);
    resources_ = std::make_unique<Resources>(field.data());
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
    for (const Tile& tile : tiles(width, height)) {
      glViewport(0, 0, tile.width, tile.height);
      target.bindForDrawing();
      drawTile(program, tile);
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
    const RayGeometry rays(space_, view.camera, width, height);
    const EglContext::Current current(context_);
    setRays(resources_->march, rays, view.offset, space_.diagonal);
    setRays(resources_->hit, rays, view.offset, space_.diagonal);
    glProgramUniform1i(resources_->march.name(), kMostSteps, stepsInPass_);
    glProgramUniform1i(resources_->hit.name(), kMostRefinements, refinements_);

    ViewBuffers buffers = emptyBuffers(width, height, true);
    const Target state(std::min(width, kTile), std::min(height, kTile));
    const Target target(std::min(width, kTile), std::min(height, kTile));
    prepare();
    state.bindForReading();
    for (const Tile& tile : tiles(width, height)) {
      glViewport(0, 0, tile.width, tile.height);
      state.bindForDrawing();
      march(tile);
      target.bindForDrawing();
      drawTile(resources_->hit, tile);
      target.readIntegers(tile.width, tile.height, integers_);
      target.readFloats(tile.width, tile.height, normals_);
      forEachPixel(tile, width, [&](std::size_t from, std::size_t to) {
        const Texel& texel = integers_[from];
        buffers.cell[to] = texel[0];
        buffers.degree[to] = static_cast<std::uint8_t>(texel[1] & 0xff);
        buffers.depth[to] = static_cast<std::uint8_t>(texel[1] >> 8);
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
    glBindVertexArray(resources_->noVertices.name());
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
  }

  /// Draws the march again until no pixel is under way, or all steps are used up.
  void march(const Tile& tile) const {
    const GLuint program = resources_->march.name();
    const GLuint query = resources_->anyPixels.name();
    glProgramUniform1i(program, kResume, GL_FALSE);
    drawTile(resources_->march, tile);
    glProgramUniform1i(program, kResume, GL_TRUE);
    for (int steps = stepsInPass_; steps < kStepsInAll; steps += stepsInPass_) {
      // the pass reads the texels that it writes, each pixel its own
      glTextureBarrier();
      glBeginQuery(GL_ANY_SAMPLES_PASSED, query);
      drawTile(resources_->march, tile);
      glEndQuery(GL_ANY_SAMPLES_PASSED);
      GLuint any = GL_FALSE;
      glGetQueryObjectuiv(query, GL_QUERY_RESULT, &any);
      if (any == GL_FALSE) break;
    }
    glTextureBarrier();
  }

  /// Calls f with each pixel's place in the tile and in the view. Rows of a target run downwards, as those of a view.
  template <typename F>
  static void forEachPixel(const Tile& tile, int viewWidth, F&& f) {
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x)
        f(std::size_t(y) * tile.width + x, std::size_t(tile.top + y) * viewWidth + tile.left + x);
  }

  EglContext context_;
  GridSpace space_;
  std::unique_ptr<Resources> resources_;
  int stepsInPass_;  ///< of a ray, in one pass
  int refinements_;
  std::vector<Texel> integers_;
  std::vector<NormalTexel> normals_;
};

}  // namespace

std::unique_ptr<Renderer> makeGlRenderer(const Field& field, GlChoice choice) {
  return std::make_unique<GlRenderer>(field, choice);
}

std::string glDescription(GlChoice choice) { return EglContext(choice).renderer(); }

}  // namespace hpsdf::render
