#include "request.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>

#include "bindings.hpp"
#include "estimate.hpp"
#include "model/option_words.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "recognition/option_text.hpp"
#include "recognition/recordings.hpp"
#include "recognition/refused_option.hpp"
#include "touches.hpp"

namespace palpate::python {

namespace {

using namespace nb::literals;

/// The value as C++ has it. Throws TypeError, which Python words, where it is of another type.
template <typename Value>
Value typed(nb::handle value) {
  return value_of<Value>(value, "another type is wanted");
}

// Each function takes an option's value from Python.

template <typename Value>
void take(const char* /*option*/, nb::handle given, Value& value) {
  value = typed<Value>(given);
}

/// Numbers, or a word that the option has.
template <typename Numbers>
std::variant<Numbers, std::string> numbers_or_word(const char* option, nb::handle given,
                                                   std::initializer_list<std::string_view> words) {
  auto value = typed<std::variant<Numbers, std::string>>(given);
  if (const auto* word = std::get_if<std::string>(&value)) {
    if (std::ranges::find(words, *word) == words.end()) {
      refuse_option(option, *word, "not known; give numbers, or {}",
                    fmt::format("'{}'", fmt::join(words.begin(), words.end(), "' or '")));
    }
  }
  return value;
}

void take(const char* option, nb::handle given, Bins& value) {
  const auto bins = numbers_or_word<std::array<int, 3>>(option, given, {"auto", "fine"});
  if (const auto* counts = std::get_if<std::array<int, 3>>(&bins)) {
    value = *counts;
  } else {
    value = std::get<std::string>(bins) == "fine" ? BinWidth::fine : BinWidth::automatic;
  }
}

void take(const char* option, nb::handle given, Pivot& value) {
  const auto pivot = numbers_or_word<std::array<double, 2>>(option, given, {"auto"});
  if (const auto* xy = std::get_if<std::array<double, 2>>(&pivot)) {
    value = glm::dvec2((*xy)[0], (*xy)[1]);
  } else {
    value = Automatic{};
  }
}

void take(const char* option, nb::handle given, NoneWeight& value) {
  const auto weight = numbers_or_word<double>(option, given, {"auto"});
  if (const auto* number = std::get_if<double>(&weight)) {
    value = *number;
  } else {
    value = Automatic{};
  }
}

void take(const char* option, nb::handle given, Frames& value) {
  const auto [begin, end] = typed<std::array<std::int64_t, 2>>(given);
  if (begin < 0 || end < 0) {
    refuse_option(option, fmt::format("{}:{}", begin, end),
                  "touches are counted from 0; give none below");
  }
  value = {static_cast<std::size_t>(begin), static_cast<std::size_t>(end)};
}

void take(const char* /*option*/, nb::handle given, FilterKind& value) {
  value = filter_named(typed<std::string>(given));
}

void take(const char* /*option*/, nb::handle given, Resampling& value) {
  value = resampling_named(typed<std::string>(given));
}

template <typename Value>
void take(const char* option, nb::handle given, std::optional<Value>& value) {
  take(option, given, value.emplace());
}

void set_option(PythonRequest& request, std::string option, nb::handle given) {
  if (option == "device") {
    const auto device =
        typed<std::variant<std::shared_ptr<Session>, std::int64_t, std::string>>(given);
    if (const auto* session = std::get_if<std::shared_ptr<Session>>(&device)) {
      request.session = *session;
    } else {
      const auto* index = std::get_if<std::int64_t>(&device);
      request.device = index != nullptr ? std::to_string(*index) : std::get<std::string>(device);
    }
    return;
  }
  std::ranges::replace(option, '_', '-');
  bool known = false;
  visit_options(request, [&](const char* name, auto& value) {
    if (option == name) {
      take(name, given, value);
      known = true;
    }
  });
  if (!known) {
    throw nb::attribute_error(option.c_str());
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
           "Sets an option of recognize(). Raises TypeError where the value is of another type.");
}

}  // namespace palpate::python
