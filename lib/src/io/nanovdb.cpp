#include "io/nanovdb.h"

#include "covol/error.h"

#ifdef COVOL_HAS_NANOVDB
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/openvdb.h>

#include <fstream>
#endif

namespace covol::detail {

#ifdef COVOL_HAS_NANOVDB

void write_nanovdb(const std::string& file, const std::string& shown, const std::vector<FloatGridPtr>& grids) {
    std::ofstream out(file, std::ios::binary);
    for (const FloatGridPtr& grid : grids)
        nanovdb::io::writeGrid(out, nanovdb::openToNanoVDB(*grid, nanovdb::StatsMode::All, nanovdb::ChecksumMode::Full),
                               nanovdb::io::Codec::NONE);
    out.close();
    if (!out) throw Error(Errc::Io, shown + ": cannot write");
}

#else

void write_nanovdb(const std::string& /*file*/, const std::string& shown, const std::vector<FloatGridPtr>& /*grids*/) {
    throw Error(Errc::Unsupported, shown +
                                       ": this covol was built without NanoVDB's headers (libnanovdb-dev); write .vdb "
                                       "and convert it with nanovdb_convert");
}

#endif

}  // namespace covol::detail
