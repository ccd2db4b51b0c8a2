#include "hpsdf/render/renderer.h"

namespace hpsdf::render {

// The destructor is defined here so that the virtual table exists once, in this library.
Renderer::~Renderer() = default;

}  // namespace hpsdf::render
