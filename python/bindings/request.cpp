#include "request.hpp"

#include <algorithm>
#include <array>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>

#include "bindings.hpp"
#include "estimate.hpp"
#include "model/option_words.hpp"
#include "options/option.hpp"
#include "options/refused_option.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "recognition/recordings.hpp"
#include "touches.hpp"

namespace palpate::python {

namespace {

using namespace nb::literals;

/// The value as C++ has it. Throws TypeError, which Python words, where it is of another type.
template <typename Value>
Value typed(nb::handle value) {
  return value_of<Value>(value, "another type is wanted");
}

/// The text of an option's value, as a flag has it; each member takes values of its type.
struct OptionText {
  nb::handle given;

  template <typename Numbers>
  static std::string joined(const Numbers& numbers, const char* separator) {
    return fmt::format("{}", fmt::join(numbers, separator));
  }
  /// Numbers, or a word.
  template <typename Numbers>
  std::string numbers_or_word(const char* separator) const {
    const auto value = typed<std::variant<Numbers, std::string>>(given);
    const auto* word = std::get_if<std::string>(&value);
    return word != nullptr ? *word : joined(std::get<Numbers>(value), separator);
  }

  std::string operator()(std::string Request::* /*of*/) const { return typed<std::string>(given); }
  std::string operator()(bool Request::* /*of*/) const {
    return fmt::format("{}", typed<bool>(given));
  }
  template <typename Number>
  requires std::is_arithmetic_v<Number> std::string operator()(
      std::optional<Number> Request::* /*of*/) const {
    return fmt::format("{}", typed<Number>(given));
  }
  std::string operator()(std::optional<Range> Request::* /*of*/) const {
    return joined(typed<Range>(given), ":");
  }
  std::string operator()(std::optional<Bins> Request::* /*of*/) const {
    return numbers_or_word<std::array<int, 3>>("x");
  }
  std::string operator()(std::optional<Pivot> Request::* /*of*/) const {
    return numbers_or_word<std::array<double, 2>>(",");
  }
  std::string operator()(std::optional<NoneWeight> Request::* /*of*/) const {
    const auto value = typed<std::variant<double, std::string>>(given);
    const auto* word = std::get_if<std::string>(&value);
    return word != nullptr ? *word : fmt::format("{}", std::get<double>(value));
  }
  std::string operator()(std::optional<Frames> Request::* /*of*/) const {
    return joined(typed<std::array<std::int64_t, 2>>(given), ":");
  }
  /// A word.
  template <typename Word>
  requires std::is_enum_v<Word> std::string operator()(
      std::optional<Word> Request::* /*of*/) const {
    return typed<std::string>(given);
  }
};

void set_option(PythonRequest& request, std::string option, nb::handle given) {
  if (option == "device") {
    const auto device =
        typed<std::variant<std::shared_ptr<Device>, std::int64_t, std::string>>(given);
    if (const auto* open = std::get_if<std::shared_ptr<Device>>(&device)) {
      request.open_device = *open;
    } else {
      const auto* index = std::get_if<std::int64_t>(&device);
      request.device = index != nullptr ? std::to_string(*index) : std::get<std::string>(device);
    }
    return;
  }
  std::ranges::replace(option, '_', '-');
  const auto row = std::ranges::find(options(), option, &Option::name);
  if (row == options().end()) {
    throw nb::attribute_error(option.c_str());
  }
  const std::string text = std::visit(OptionText{given}, row->member);
  if (const std::string remedy = palpate::set_option(request, *row, text); !remedy.empty()) {
    refuse_option(option, text, "{}", remedy);
  }
}

/// A list of what an argument gives: one item, or an iterable of them.
nb::object items_of(nb::handle given) {
  const bool is_one = is_path(given.ptr()) || nb::isinstance<ArrayRecording>(given) ||
                      nb::isinstance<OccupancyGrid>(given) || nb::isinstance<Hypothesis>(given);
  return call("builtins", "list", is_one ? nb::make_tuple(given) : nb::borrow(given));
}

}  // namespace

void add_maps(nb::handle given, Request& request) {
  for (const nb::handle item : items_of(given)) {
    if (const auto hypothesis = hypothesis_in(item)) {
      request.given_maps.push_back({fmt::format("map '{}'", hypothesis->map.label), *hypothesis});
    } else {
      request.maps.push_back(nb::borrow<PathLike>(item).text());
    }
  }
  if (!request.given_maps.empty()) {
    read_maps(request);
  }
}

void read_maps(Request& request) {
  for (const std::string& argument : request.maps) {
    for (const std::filesystem::path& file : map_files(argument)) {
      request.given_maps.push_back({file.string(), {.map = read_map(file)}});
    }
  }
}

std::vector<Recording> read_recordings(const GivenRecordings& given) {
  std::vector<std::string> files;
  for (const auto& item : given) {
    if (const auto* file = std::get_if<std::string>(&item)) {
      files.push_back(*file);
    }
  }
  std::vector<Recording> read_files = read_touch_recordings(files);
  std::vector<Recording> all;
  auto file = read_files.begin();
  for (const auto& item : given) {
    const auto* recording = std::get_if<Recording>(&item);
    all.push_back(recording == nullptr ? std::move(*file++) : *recording);
    require_touches(all.back(), all.front());
  }
  return all;
}

GivenRecordings given_recordings(nb::handle given) {
  GivenRecordings recordings;
  for (const nb::handle item : items_of(given)) {
    const ArrayRecording* recording = nullptr;
    if (nb::try_cast(item, recording) && recording != nullptr) {
      Recording copy = recording->copied();
      if (copy.path.empty()) {
        copy.path = fmt::format("recordings[{}]", recordings.size());
      }
      recordings.emplace_back(std::move(copy));
    } else {
      recordings.emplace_back(nb::borrow<PathLike>(item).text());
    }
  }
  if (recordings.empty()) {
    throw Error(Fault::input, "recordings: none; give a Recording or a file");
  }
  return recordings;
}

Subject subject_of(const GivenRecordings& recordings, const Request& given) {
  Subject subject{complete(given), read_recordings(recordings), {}};
  for (Recording& recording : subject.recordings) {
    replace_array(subject.request, recording.path, recording.elements(), recording.elements_mm);
  }
  subject.unknowns = list_unknowns(subject.request, subject.recordings);
  return subject;
}

RecognitionTask task_of(const Subject& subject, Device& device, const CallerNeed& need) {
  const Recording& first = subject.recordings.front();
  return resolve(subject.request, {.pressure_unit = first.pressure_unit,
                                   .source = first.path,
                                   .reach_mm = largest_reach_mm(subject.recordings),
                                   .need = need,
                                   .device = [&device]() -> Device& { return device; }});
}

Sentences in_python(Sentences sentences) {
  std::ranges::transform(sentences, sentences.begin(), in_keywords);
  return sentences;
}

void bind_request(nb::module_& module) {
  nb::class_<PythonRequest>(module, "Request", "What is asked of a recognition.")
      .def(
          "__init__",
          [](PythonRequest* self, nb::handle maps) {
            PythonRequest request;
            add_maps(maps, request);
            new (self) PythonRequest(std::move(request));
          },
          "maps"_a = nb::make_tuple())
      .def("__setattr__", &set_option, "option"_a, "value"_a,
           "Sets an option of recognize(). Raises TypeError where the value is of another type.")
      .def_static(
          "options",
          [] {
            std::vector<std::string> names;
            for (const Option& option : options()) {
              names.emplace_back(option.name);
              std::ranges::replace(names.back(), '-', '_');
            }
            return names;
          },
          "The names of all options of recognize().");
}

}  // namespace palpate::python
