// Asio's own code, compiled once: header-only it would cost every user of Asio 12 s.
#define BOOST_ASIO_SEPARATE_COMPILATION
#define BOOST_ASIO_DISABLE_BOOST_COROUTINE
#include <boost/asio/impl/src.hpp>
