// version.h : the version that the listing and --version show
#ifndef MPFE_BASE_VERSION_H
#define MPFE_BASE_VERSION_H

#define MPFE_VERSION "0.3"

#endif
