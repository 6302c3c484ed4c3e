#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <nlohmann/json.hpp>

#include "bindings.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"
#include "recognition/resolve.hpp"
#include "request.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Json = nlohmann::ordered_json;

nb::object to_python(const Json& json) {
  switch (json.type()) {
    case Json::value_t::object: {
      nb::dict result;
      for (const auto& [key, value] : json.items()) {
        result[key.c_str()] = to_python(value);
      }
      return result;
    }
    case Json::value_t::array: {
      nb::list result;
      for (const Json& value : json) {
        result.append(to_python(value));
      }
      return result;
    }
    case Json::value_t::string: {
      const auto& text = json.get_ref<const std::string&>();
      // The path of a recording need not be UTF-8.
      return nb::steal(
          PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size())));
    }
    case Json::value_t::boolean:
      return nb::bool_(json.get<bool>());
    case Json::value_t::number_integer:
    case Json::value_t::number_unsigned:
      return nb::int_(json.get<std::int64_t>());
    case Json::value_t::number_float:
      return nb::float_(json.get<double>());
    default:
      return nb::none();
  }
}

struct Answer {
  Json records = Json::array();
  Sentences sentences;
};

Answer recognize(const Subject& subject, Device& device, Call& call) {
  const std::function<void(double)> progress = call.progress();
  Answer answer;
  const std::vector<Unknown>& unknowns = subject.unknowns;
  const bool with_trace = subject.request.trace;
  const RecognitionTask task = task_of(subject, device, call);
  Recogniser recogniser = open_recogniser(device, task);
  answer.sentences = task.remarks;
  std::string unresolved;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto show = [&](double fraction) {
      progress((static_cast<double>(i) + fraction) / static_cast<double>(unknowns.size()));
    };
    const RecognitionRecord record = recognise(recogniser, task, unknowns[i], with_trace, show);
    record.require_steps();
    if (unresolved.empty()) {
      unresolved = unresolved_words(task, recogniser.lattice(), unknowns[i].touches);
    }
    answer.records.push_back(to_json(record, task, device.name(), with_trace, in_keywords));
  }
  if (!unresolved.empty()) {
    answer.sentences.push_back(unresolved);
  }
  return answer;
}

using Records = nb::typed<nb::list, nb::typed<nb::dict, nb::str, nb::any>>;

std::tuple<Records, Sentences> recognize_python(nb::handle recordings, const PythonRequest& request,
                                                const Progress& progress) {
  const Answer answer = run_on_subject(recordings, request, progress, &recognize);
  return {nb::borrow<Records>(to_python(answer.records)), in_python(answer.sentences)};
}

}  // namespace

void bind_recognition(nb::module_& module) {
  module.def("recognize", &recognize_python, "recordings"_a, "request"_a, "progress"_a = nb::none(),
             "Records as in the JSON of `palpate recognize`, and what is worth a warning.");
}

}  // namespace palpate::python
