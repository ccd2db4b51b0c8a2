#include "ranks/mpi_group.h"

#include "hpsdf/mpi.h"
#include "ranks/process_group.h"

namespace hpsdf::app {

int withProcessGroup(const std::function<int(ProcessGroup&)>& work) {
  const mpi::Session session;
  ProcessGroup group{.ranks = mpi::allRanks()};
  return work(group);
}

}  // namespace hpsdf::app
