#include "console/console.h"
#include "hpsdf/error.h"
#include "simulate/simulation.h"

namespace hpsdf::app {

SimulationFigures simulate(const Console&, const std::string&, const SceneRequest&, double, int,
                           const SimulationCamera*) {
  throw Error("simulate: this program was built without Bullet: install libbullet-dev, and build it anew");
}

}  // namespace hpsdf::app
