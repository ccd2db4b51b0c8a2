// Counts the calls of MPI that a process makes, by MPI's profiling interface: loaded before the program (LD_PRELOAD),
// it stands between it and MPI. When MPI ends, each process appends a line of JSON to the file that HPSDF_MPI_COUNTS
// names.

#include <mpi.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

struct Counts {
  std::uint64_t toAll = 0;         ///< calls by which each process sends to all
  std::uint64_t bytesToAll = 0;    ///< bytes of this process's own messages in them
  std::uint64_t messages = 0;      ///< messages to single processes
  std::uint64_t messageBytes = 0;  ///< their bytes
  double start = 0;                ///< when MPI was ready
} counts;

/// Returns the greatest memory that this process has used, in kB.
long peakMemory() {
  std::FILE* const status = std::fopen("/proc/self/status", "r");
  if (status == nullptr) return 0;
  char line[256];
  long peak = 0;
  while (std::fgets(line, sizeof line, status) != nullptr)
    if (std::strncmp(line, "VmHWM:", 6) == 0) peak = std::atol(line + 6);
  std::fclose(status);
  return peak;
}

void countToAll(int count) {
  ++counts.toAll;
  counts.bytesToAll += std::uint64_t(count);
}

}  // namespace

extern "C" {

int MPI_Init_thread(int* argc, char*** argv, int required, int* provided) {
  const int result = PMPI_Init_thread(argc, argv, required, provided);
  counts.start = PMPI_Wtime();
  return result;
}

int MPI_Iallgather(const void* sent, int sentCount, MPI_Datatype sentType, void* received, int receivedCount,
                   MPI_Datatype receivedType, MPI_Comm communicator, MPI_Request* request) {
  countToAll(sentCount);
  return PMPI_Iallgather(sent, sentCount, sentType, received, receivedCount, receivedType, communicator, request);
}

int MPI_Iallgatherv(const void* sent, int sentCount, MPI_Datatype sentType, void* received, const int* receivedCounts,
                    const int* places, MPI_Datatype receivedType, MPI_Comm communicator, MPI_Request* request) {
  countToAll(sentCount);
  return PMPI_Iallgatherv(sent, sentCount, sentType, received, receivedCounts, places, receivedType, communicator,
                          request);
}

int MPI_Iallreduce(const void* sent, void* received, int count, MPI_Datatype type, MPI_Op operation,
                   MPI_Comm communicator, MPI_Request* request) {
  int size = 0;
  PMPI_Type_size(type, &size);
  countToAll(count * size);
  return PMPI_Iallreduce(sent, received, count, type, operation, communicator, request);
}

int MPI_Isend(const void* sent, int count, MPI_Datatype type, int to, int tag, MPI_Comm communicator,
              MPI_Request* request) {
  ++counts.messages;
  counts.messageBytes += std::uint64_t(count);
  return PMPI_Isend(sent, count, type, to, tag, communicator, request);
}

int MPI_Finalize() {
  int rank = 0;
  PMPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (const char* const name = std::getenv("HPSDF_MPI_COUNTS")) {
    if (std::FILE* const file = std::fopen(name, "a")) {
      std::fprintf(
          file,
          "{\"rank\": %d, \"to_all\": %llu, \"bytes_to_all\": %llu, \"messages\": %llu, \"message_bytes\": %llu, "
          "\"peak_kb\": %ld, \"seconds\": %.3f}\n",
          rank, static_cast<unsigned long long>(counts.toAll), static_cast<unsigned long long>(counts.bytesToAll),
          static_cast<unsigned long long>(counts.messages), static_cast<unsigned long long>(counts.messageBytes),
          peakMemory(), PMPI_Wtime() - counts.start);
      std::fclose(file);
    }
  }
  return PMPI_Finalize();
}

}  // extern "C"
