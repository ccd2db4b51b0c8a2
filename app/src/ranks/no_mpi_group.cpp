#include "hpsdf/error.h"
#include "ranks/mpi_group.h"

namespace hpsdf::app {

int withProcessGroup(const std::function<int(ProcessGroup&)>&) {
  throw Error(
      "this program was built without MPI, and each process would build the whole field: start it without mpirun, or "
      "install libopenmpi-dev and build it again");
}

}  // namespace hpsdf::app
