#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "options/request.hpp"
#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The request with all that it leaves out and its scene file gives. @throws Error
Request complete(Request request);

/// The objects to recognise, by their files, or by the names of the maps in memory.
/// @throws Error where there are none, or a folder has no maps
std::vector<Scene::Object> objects_of(const Request& request);

/// The files that the task depends on, after the options that name them: the scene, its array, the
/// sensor model, the maps with the sensor models beside them. @throws Error as objects_of() does
std::vector<std::pair<std::string, std::filesystem::path>> files_of(const Request& request);

/// Whether neither bins nor any part of a region are given: the region then follows from the maps
/// and the touches' arrays.
bool infers_region(const Request& request);

/// The bins of a request that does not infer the region; what it leaves open is PoseLattice's. The
/// pivot is (0, 0) where it is automatic. @throws Error
PoseLattice given_lattice(const Request& request);
bool has_auto_pivot(const Request& request);

/// Replaces the source's array by the scene's, where the scene has an array. @throws Error where
/// the two differ in their number of elements
void replace_array(const Request& request, const std::string& source, std::size_t elements,
                   std::vector<glm::dvec2>& elements_mm);
/// The same of a recording.
void replace_array(const Request& request, Recording& recording);

}  // namespace palpate
