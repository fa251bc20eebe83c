//! Failures among several servers and several processes.

mod servers;
