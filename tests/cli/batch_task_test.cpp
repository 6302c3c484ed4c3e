#include "recognition/batch/batch_task.hpp"

#include <gtest/gtest.h>

#include "support/scratch_folder.hpp"

namespace palpate::batch_task_test {

TEST(BatchTask, OfTwoThatAreWrittenTheFirstStays) {
  const ScratchFolder folder;
  const std::filesystem::path file = folder / "task.ndjson";
  EXPECT_TRUE(write_batch_task(file, {.program = "a", .chunk_unknowns = 1}));
  EXPECT_FALSE(write_batch_task(file, {.program = "b", .chunk_unknowns = 1}));
  EXPECT_EQ(read_batch_task(file).program, "a");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

}  // namespace palpate::batch_task_test
