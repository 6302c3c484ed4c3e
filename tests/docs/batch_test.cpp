// Every command of docs/batch.md runs, and says what the page quotes.

#include "document.hpp"

namespace palpate::batch_test {

using BatchDocument = DocumentTest;

TEST_F(BatchDocument, ItsCommandsRecogniseAndMerge) {
  const auto [said, complained] = run("batch.md");
  EXPECT_NE(complained.find("listed/: 4 of 4 unknowns, 1 failed"), complained.npos) << complained;
  EXPECT_EQ(scores("results")["accuracy"], 1.0);
  expect_written({"all.ndjson", "shared.ndjson", "results/runs/000002.json"});
}

}  // namespace palpate::batch_test
