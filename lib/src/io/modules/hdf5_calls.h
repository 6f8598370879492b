#pragma once
#include <hdf5.h>

#include "io/modules/modules.h"

// Wrappers with the names of the HDF5 library's functions. The library is in a module that is loaded by the first call.
// Code in namespace covol::detail calls the wrappers, because name lookup finds them before the global functions. A
// call of a function that is missing in this list calls the library directly, so that linking a program fails.
// clang-format off
#define COVOL_HDF5_FUNCTIONS(X) \
    X(H5open) X(H5check_version) X(H5Aclose) X(H5Aexists_by_name) X(H5Aget_space) X(H5Aget_type) \
    X(H5Aopen_by_name) X(H5Aread) X(H5Dget_chunk_storage_size) X(H5Dget_create_plist) X(H5Dget_offset) \
    X(H5Dget_space) X(H5Dget_type) X(H5Dread) X(H5Dread_chunk) X(H5Dvlen_reclaim) X(H5Eget_auto2) \
    X(H5Eset_auto2) X(H5Ewalk2) X(H5Fclose) X(H5Fopen) X(H5Iget_type) X(H5Lget_info) X(H5Literate_by_name) X(H5Oclose) \
    X(H5Oexists_by_name) X(H5Oget_info_by_name2) X(H5Oopen) X(H5Pclose) X(H5Pcreate) X(H5Pfill_value_defined) \
    X(H5Pget_chunk) X(H5Pget_external_count) X(H5Pget_fill_value) X(H5Pget_filter2) X(H5Pget_layout) \
    X(H5Pget_nfilters) X(H5Pset_elink_cb) X(H5Pset_fclose_degree) X(H5Pset_file_locking) X(H5Sclose) \
    X(H5Screate_simple) X(H5Sget_simple_extent_dims) X(H5Sget_simple_extent_ndims) \
    X(H5Sget_simple_extent_npoints) X(H5Sget_simple_extent_type) X(H5Sselect_hyperslab) X(H5Tclose) X(H5Tcopy) \
    X(H5Tequal) X(H5Tget_class) X(H5Tget_order) X(H5Tget_size) X(H5Tget_super) X(H5Tis_variable_str) \
    X(H5Tset_ebias) X(H5Tset_fields) X(H5Tset_order) X(H5Tset_size) X(H5Zfilter_avail) X(H5Zget_filter_info)
// Variables, set by H5open(), that H5T_NATIVE_DOUBLE and similar macros refer to.
#define COVOL_HDF5_NUMBERS(X) \
    X(H5P_CLS_FILE_ACCESS_ID_g) X(H5P_CLS_LINK_ACCESS_ID_g) X(H5T_IEEE_F32LE_g) X(H5T_IEEE_F64LE_g) \
    X(H5T_NATIVE_DOUBLE_g) X(H5T_STD_I8LE_g) X(H5T_STD_I16LE_g) X(H5T_STD_I32LE_g) X(H5T_STD_I64LE_g) \
    X(H5T_STD_U8LE_g) X(H5T_STD_U16LE_g) X(H5T_STD_U32LE_g) X(H5T_STD_U64LE_g)
// clang-format on

namespace covol::detail {

struct Hdf5Calls {
#define COVOL_MEMBER(name) decltype(&::name) name;  // NOLINT(bugprone-macro-parentheses)
    COVOL_HDF5_FUNCTIONS(COVOL_MEMBER)
    COVOL_HDF5_NUMBERS(COVOL_MEMBER)
#undef COVOL_MEMBER
};

template <typename Type, Type Hdf5Calls::*Member>
struct Hdf5Function {
    operator Type() const { return hdf5_module().calls->*Member; }
};
template <hid_t* Hdf5Calls::*Member>
struct Hdf5Number {
    operator hid_t() const { return *(hdf5_module().calls->*Member); }
};

#define COVOL_FUNCTION(name) inline constexpr Hdf5Function<decltype(Hdf5Calls::name), &Hdf5Calls::name> name;  // NOLINT
COVOL_HDF5_FUNCTIONS(COVOL_FUNCTION)
#undef COVOL_FUNCTION
#define COVOL_NUMBER(name) inline constexpr Hdf5Number<&Hdf5Calls::name> name;
COVOL_HDF5_NUMBERS(COVOL_NUMBER)
#undef COVOL_NUMBER

}  // namespace covol::detail
