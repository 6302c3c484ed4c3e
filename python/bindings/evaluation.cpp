#include <string>
#include <vector>

#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "call.hpp"
#include "json.hpp"
#include "recognition/judged_results.hpp"
#include "recognition/record_json.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

Fields evaluate_results(const std::vector<std::string>& paths, const nb::bytes& records) {
  const std::string text(records.c_str(), records.size());
  return fields_of(run([&] {
    JudgedResults results = read_results(result_files(paths));
    add_records("records", text, results);
    return to_json(evaluate(results, paths.empty() ? "records" : paths.front()), results);
  }));
}

}  // namespace

void bind_evaluation(nb::module_& module) {
  module.def("evaluate_results", &evaluate_results, "paths"_a, "records"_a,
             "The JSON of `palpate evaluate`, of files and folders of results, and of more records "
             "as a\nJSON array.");
}

}  // namespace palpate::python
